#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "schema/base/json.h"

namespace vantage::html {

/// Text made safe for elements and quoted attributes.
std::string escape(std::string_view text);

/// <h2> with an id to jump to, then the content; nothing when the content is empty.
std::string section(std::string_view title, const std::string& content);

/// cells are HTML already; the first row is the head.
std::string table(const std::vector<std::vector<std::string>>& rows);

/// A picture with its caption. Small files are put into the page; bigger ones are linked, relative to page_folder.
std::string picture(const std::filesystem::path& file, const std::filesystem::path& page_folder,
                    std::string_view caption);

/// preview.jpg, preview.svg or frame.png of an artifact, whichever is there; empty path when none is.
std::filesystem::path preview_of(const std::filesystem::path& artifact);

/// "12 s", "3:25 min", "1:02 h".
std::string duration(double seconds);

/// A figure as people read it: four significant digits, lists joined by commas.
std::string figure(const Json& value);

}  // namespace vantage::html
