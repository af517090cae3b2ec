#include "schema/formats/patches.h"

#include <fmt/format.h>

#include <cstring>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

constexpr const char* kHeader =
    "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
    "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
    "property float vx\nproperty float vy\nproperty float vz\nproperty float t0\nproperty float t1\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float score\nproperty int "
    "num_views\nend_header\n";
constexpr const char* kPointsHeader =
    "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
    "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";

template <class T>
void put(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put(std::string& out, const Eigen::Vector3f& v) {
  for (int i = 0; i < 3; ++i) put(out, v[i]);
}

/// Takes values off a byte string in the order they were put.
class Bytes {
 public:
  Bytes(const std::string& data, std::size_t at) : data_(data), at_(at) {}
  template <class T>
  T take() {
    T value;
    std::memcpy(&value, data_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  Eigen::Vector3f take_vector() {
    const float x = take<float>(), y = take<float>(), z = take<float>();
    return {x, y, z};
  }

 private:
  const std::string& data_;
  std::size_t at_;
};

constexpr std::size_t kRecordBytes = 11 * 4 + 3 + 4 + 4;

}  // namespace

void write_patches_ply(const std::filesystem::path& path, const std::vector<Patch>& patches) {
  std::string out = fmt::format(fmt::runtime(kHeader), patches.size());
  for (const Patch& p : patches) {
    put(out, p.position);
    put(out, p.normal);
    put(out, p.velocity);
    put(out, p.t0_s);
    put(out, p.t1_s);
    for (int i = 0; i < 3; ++i) put(out, p.rgb[i]);
    put(out, p.score);
    put(out, p.num_views);
  }
  write_file_atomically(path, out);
}

std::vector<Patch> read_patches_ply(const std::filesystem::path& path) {
  const std::string data = read_file(path);
  const std::string prefix = "element vertex ";
  const std::size_t count_at = data.find(prefix);
  const std::size_t end = data.find("end_header\n");
  if (count_at == std::string::npos || end == std::string::npos)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is no PLY file", path.string()));
  const std::size_t count = std::stoul(data.substr(count_at + prefix.size()));
  const std::size_t body = end + std::strlen("end_header\n");
  if (data.substr(0, body) != fmt::format(fmt::runtime(kHeader), count) || data.size() != body + count * kRecordBytes)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is no patch file of this version, or cut short", path.string()));
  std::vector<Patch> patches(count);
  Bytes bytes(data, body);
  for (Patch& p : patches) {
    p.position = bytes.take_vector();
    p.normal = bytes.take_vector();
    p.velocity = bytes.take_vector();
    p.t0_s = bytes.take<float>();
    p.t1_s = bytes.take<float>();
    for (int i = 0; i < 3; ++i) p.rgb[i] = bytes.take<unsigned char>();
    p.score = bytes.take<float>();
    p.num_views = bytes.take<int>();
  }
  return patches;
}

void write_points_ply(const std::filesystem::path& path, const std::vector<Patch>& patches, float time_s) {
  std::string out = fmt::format(fmt::runtime(kPointsHeader), patches.size());
  for (const Patch& p : patches) {
    put(out, p.position_at(time_s));
    put(out, p.normal);
    for (int i = 0; i < 3; ++i) put(out, p.rgb[i]);
  }
  write_file_atomically(path, out);
}

}  // namespace vantage
