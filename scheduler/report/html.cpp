#include "scheduler/report/html.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <cmath>
#include <cstdint>

#include "schema/base/files.h"

namespace vantage::html {
namespace fs = std::filesystem;
namespace {

/// Above this a picture is linked: a page of some dozen pictures stays below 10 MB.
constexpr std::uintmax_t kMaxEmbeddedBytes = 200'000;

std::string base64(const std::string& bytes) {
  std::string out(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int length =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()),
                      reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  out.resize(static_cast<std::size_t>(length));
  return out;
}

std::string mime_type(const fs::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".svg" ? "image/svg+xml" : ending == ".png" ? "image/png" : "image/jpeg";
}

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else
      out += c;
  }
  return out;
}

std::string section(std::string_view title, const std::string& content) {
  if (content.empty()) return {};
  return fmt::format("<section><h2>{}</h2>\n{}</section>\n", escape(title), content);
}

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::string out = "<div class=\"scroll\"><table>";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const char* tag = r == 0 ? "th" : "td";
    out += "<tr>";
    for (const auto& cell : rows[r]) out += fmt::format("<{0}>{1}</{0}>", tag, cell);
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string picture(const fs::path& file, const fs::path& page_folder, std::string_view caption) {
  std::error_code ignored;
  const std::uintmax_t size = fs::file_size(file, ignored);
  if (ignored) return {};
  const std::string source = size <= kMaxEmbeddedBytes
                                 ? fmt::format("data:{};base64,{}", mime_type(file), base64(read_file(file)))
                                 : escape(file.lexically_relative(page_folder).string());
  return fmt::format("<figure><img src=\"{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>\n", source,
                     escape(caption), escape(caption));
}

fs::path preview_of(const fs::path& artifact) {
  if (artifact.empty()) return {};
  for (const char* name : {"preview.jpg", "preview.svg", "preview.png", "frame.png"})
    if (fs::is_regular_file(artifact / name)) return artifact / name;
  return {};
}

std::string duration(double seconds) {
  const auto whole = static_cast<std::int64_t>(std::llround(seconds));
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

std::string figure(const Json& value) {
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  if (value.is_string()) return escape(value.get<std::string>());
  if (!value.is_array()) return escape(value.dump());
  std::string out;
  for (const auto& item : value) out += (out.empty() ? "" : ", ") + figure(item);
  return out;
}

}  // namespace vantage::html
