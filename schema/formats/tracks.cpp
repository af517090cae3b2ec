#include "schema/formats/tracks.h"

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/binary.h"

namespace vantage {
namespace {

constexpr char kMagic[4] = {'V', 'T', 'R', 'K'};
constexpr std::uint32_t kVersion = 1;

void put_track(BinaryWriter& out, const Track& track) {
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

Track get_track(BinaryReader& in) {
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
  BinaryWriter out;
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
  BinaryReader in(read_file(file), file.string());
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
