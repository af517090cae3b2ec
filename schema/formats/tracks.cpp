#include "schema/formats/tracks.h"

#include <bit>
#include <cstring>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");
constexpr char kMagic[4] = {'V', 'T', 'R', 'K'};
constexpr std::uint32_t kVersion = 1;

class Writer {
 public:
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void put_size(std::size_t n) { put(static_cast<std::uint32_t>(n)); }
  void put_bytes(const void* data, std::size_t n) { bytes_.append(static_cast<const char*>(data), n); }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Reader {
 public:
  Reader(std::string bytes, std::string where) : bytes_(std::move(bytes)), where_(std::move(where)) {}
  template <class T>
  T get() {
    T value;
    get_bytes(&value, sizeof(T));
    return value;
  }
  /// A count of things of at least item_bytes each: refused when the file cannot hold them.
  std::size_t get_size(std::size_t item_bytes) {
    const std::size_t n = get<std::uint32_t>();
    if (n > (bytes_.size() - at_) / item_bytes) fail("is truncated");
    return n;
  }
  void get_bytes(void* data, std::size_t n) {
    if (n > bytes_.size() - at_) fail("is truncated");
    std::memcpy(data, bytes_.data() + at_, n);
    at_ += n;
  }
  bool at_end() const { return at_ == bytes_.size(); }
  [[noreturn]] void fail(const std::string& what) const { throw Error(ErrorKind::BadInput, where_ + ": " + what); }

 private:
  std::string bytes_, where_;
  std::size_t at_ = 0;
};

void put_track(Writer& out, const Track& track) {
  out.put(static_cast<std::int32_t>(track.first_frame));
  out.put_size(track.px.size());
  out.put_size(track.looks.size());
  out.put(static_cast<std::uint8_t>(track.moving));
  out.put(track.motion_px);
  for (const auto& px : track.px) out.put_bytes(px.data(), 2 * sizeof(float));
  for (const auto& look : track.looks) {
    out.put(static_cast<std::int32_t>(look.frame));
    out.put_bytes(look.descriptor.data(), look.descriptor.size());
  }
}

Track get_track(Reader& in) {
  Track track;
  track.first_frame = in.get<std::int32_t>();
  track.px.resize(in.get_size(2 * sizeof(float)));
  track.looks.resize(in.get_size(sizeof(std::int32_t) + 128));
  track.moving = in.get<std::uint8_t>() != 0;
  track.motion_px = in.get<float>();
  for (auto& px : track.px) in.get_bytes(px.data(), 2 * sizeof(float));
  for (auto& look : track.looks) {
    look.frame = in.get<std::int32_t>();
    in.get_bytes(look.descriptor.data(), look.descriptor.size());
  }
  return track;
}

}  // namespace

void write_tracks(const std::filesystem::path& file, const TrackSet& tracks) {
  Writer out;
  out.put(kMagic);
  out.put(kVersion);
  out.put_size(tracks.camera.size());
  out.put_bytes(tracks.camera.data(), tracks.camera.size());
  out.put(static_cast<std::int32_t>(tracks.width));
  out.put(static_cast<std::int32_t>(tracks.height));
  out.put_size(tracks.tracks.size());
  for (const auto& track : tracks.tracks) put_track(out, track);
  write_file_atomically(file, out.bytes());
}

TrackSet read_tracks(const std::filesystem::path& track_artifact) {
  const auto file = track_artifact / "tracks.bin";
  Reader in(read_file(file), file.string());
  char magic[4];
  in.get_bytes(magic, sizeof magic);
  if (std::memcmp(magic, kMagic, sizeof magic) != 0) in.fail("is no track file, expected it to begin with VTRK");
  if (const auto version = in.get<std::uint32_t>(); version != kVersion)
    in.fail("has version " + std::to_string(version) + ", expected " + std::to_string(kVersion));
  TrackSet tracks;
  tracks.camera.resize(in.get_size(1));
  in.get_bytes(tracks.camera.data(), tracks.camera.size());
  tracks.width = in.get<std::int32_t>();
  tracks.height = in.get<std::int32_t>();
  constexpr std::size_t kSmallestTrack = 17;
  tracks.tracks.resize(in.get_size(kSmallestTrack));
  for (auto& track : tracks.tracks) track = get_track(in);
  if (!in.at_end()) in.fail("has bytes after its last track");
  return tracks;
}

}  // namespace vantage
