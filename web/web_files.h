#pragma once
#include <span>
#include <string_view>

namespace vantage {

/// A file of the page, inside the binary: "/index.html", "/style.css", "/app.js".
struct WebFile {
  std::string_view path;
  std::string_view bytes;
};

std::span<const WebFile> web_files();

}  // namespace vantage
