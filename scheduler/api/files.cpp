#include "scheduler/api/files.h"

#include <algorithm>
#include <fstream>
#include <map>

namespace vantage {
namespace fs = std::filesystem;
namespace {

bool is_below(const fs::path& file, const fs::path& folder) {
  const auto [f, rest] = std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
  return f == folder.end() && rest != file.end();
}

}  // namespace

fs::path servable_file(const fs::path& shot_folder, const std::string& relative) {
  const fs::path out = shot_folder / "out", store = shot_folder / ".vantage" / "store";
  const fs::path asked = (shot_folder / relative).lexically_normal();
  if (!is_below(asked, out.lexically_normal()) && !is_below(asked, store.lexically_normal())) return {};
  std::error_code none;
  const fs::path real = fs::canonical(asked, none);
  if (none || !fs::is_regular_file(real)) return {};
  const bool inside =
      is_below(real, fs::weakly_canonical(out, none)) || is_below(real, fs::weakly_canonical(store, none));
  return inside ? real : fs::path{};
}

std::string content_type(const fs::path& file) {
  static const std::map<std::string, std::string> types{{".html", "text/html; charset=utf-8"},
                                                        {".css", "text/css"},
                                                        {".js", "text/javascript"},
                                                        {".json", "application/json"},
                                                        {".svg", "image/svg+xml"},
                                                        {".png", "image/png"},
                                                        {".jpg", "image/jpeg"},
                                                        {".mp4", "video/mp4"},
                                                        {".txt", "text/plain; charset=utf-8"},
                                                        {".exr", "image/x-exr"}};
  const auto found = types.find(file.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

std::string read_part(const fs::path& file, std::uintmax_t offset, std::uintmax_t max_bytes) {
  std::error_code none;
  const std::uintmax_t size = fs::file_size(file, none);
  if (none || offset >= size) return {};
  std::string bytes(std::min(max_bytes, size - offset), '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(offset));
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return bytes;
}

}  // namespace vantage
