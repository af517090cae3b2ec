#include "schema/shot/shot.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/shot/placement.h"
#include "schema/shot/toml_section.h"

namespace vantage {
namespace fs = std::filesystem;

std::string Section::where(const std::string& key) const {
  const auto found = values.find(key);
  return fmt::format("{}:{}: [{}] {}", file, found != values.end() ? found->second.line : line, name, key);
}

Section Shot::section(const std::string& kind) const {
  const auto found = sections.find(kind);
  return found != sections.end() ? found->second : Section{.file = "shot.toml", .name = kind, .line = 0, .values = {}};
}

std::string Shot::text(const std::string& kind, const std::string& key, const std::string& fallback) const {
  const Section s = section(kind);
  const auto found = s.values.find(key);
  return found != s.values.end() && found->second.value.is_string() ? found->second.value.get<std::string>() : fallback;
}

const ShotCamera& Shot::camera(const std::string& camera_name) const {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == camera_name; });
  check(found != cameras.end(), "a camera is only asked for by a name of the shot: " + camera_name);
  return *found;
}

namespace {

class Reader {
 public:
  Reader(fs::path folder, const std::vector<std::string>& section_names)
      : folder_(std::move(folder)), file_((folder_ / "shot.toml").string()), section_names_(section_names) {}

  Shot read() {
    const toml::table root = parse();
    shot_.folder = fs::absolute(folder_).lexically_normal();
    if (shot_.folder.filename().empty()) shot_.folder = shot_.folder.parent_path();
    shot_.name = shot_.folder.filename().string();
    for (const auto& [key, node] : root) read_top_level(std::string(key.str()), node);
    if (!farm_.values.empty()) shot_.sections["farm"] = farm_;
    check_cameras();
    return std::move(shot_);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw Error(ErrorKind::BadInput, fmt::format("{}:{}: {}", file_, line, message));
  }

  toml::table parse() const {
    if (!fs::is_directory(folder_))
      throw Error(ErrorKind::BadInput, fmt::format("{}: no such shot folder", folder_.string()));
    if (!fs::is_regular_file(file_))
      throw Error(ErrorKind::BadInput, fmt::format("{}: not found; 'vantage init' writes one from footage", file_));
    return parse_toml(file_);
  }

  void read_top_level(const std::string& key, const toml::node& node) {
    if (key == "shot") return read_shot_table(table_of(node, key));
    if (key == "camera" || key == "render") return read_array(key, node);
    if (key == "farm") return read_farm_table(table_of(node, key));
    if (std::find(section_names_.begin(), section_names_.end(), key) == section_names_.end()) {
      std::vector<std::string> known = section_names_;
      for (const char* word : {"shot", "camera", "render", "farm"}) known.emplace_back(word);
      fail(line_of(node), fmt::format("unknown table [{}]{}", key, did_you_mean(key, known)));
    }
    Section section = flat_section(table_of(node, key), file_, key);
    move_placement(section, farm_);
    shot_.sections[key] = std::move(section);
  }

  /// See placement.h.
  void read_farm_table(const toml::table& table) {
    Section s = flat_section(table, file_, "farm");
    for (const char* key : {"pool", "tags"})
      if (auto value = s.values.extract(key)) farm_.values.insert(std::move(value));
    reject_rest(s, {"pool", "tags"});
  }

  const toml::table& table_of(const toml::node& node, const std::string& key) const {
    if (const auto* table = node.as_table()) return *table;
    fail(line_of(node), fmt::format("'{}' must be a table: [{}]", key, key));
  }

  void read_shot_table(const toml::table& table) {
    Section s = flat_section(table, file_, "shot");
    shot_.name = take<std::string>(s, "name", shot_.name);
    reject_rest(s, std::vector<std::string>{"name"});
  }

  void read_array(const std::string& key, const toml::node& node) {
    const auto* array = node.as_array();
    if (array == nullptr) fail(line_of(node), fmt::format("write [[{}]] with double brackets", key));
    for (const auto& item : *array) {
      const auto* table = item.as_table();
      if (table == nullptr) fail(line_of(item), fmt::format("every [[{}]] must be a table", key));
      if (key == "camera")
        read_camera(*table);
      else
        read_render(*table);
    }
  }

  /// Takes a value out of the section; the fallback when it is not there.
  template <class T>
  T take(Section& s, const std::string& key, T fallback) const {
    const auto found = s.values.find(key);
    if (found == s.values.end()) return fallback;
    const Json v = found->second.value;
    const std::string where = s.where(key);
    s.values.erase(found);
    constexpr bool is_number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
    const bool ok = std::is_same_v<T, bool> ? v.is_boolean() : is_number ? v.is_number() : v.is_string();
    if (!ok)
      throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, expected {}", where, v.dump(),
                                                   std::is_same_v<T, bool> ? "true or false"
                                                   : is_number             ? "a number"
                                                                           : "text"));
    return v.get<T>();
  }

  std::optional<double> take_number(Section& s, const std::string& key) const {
    if (!s.values.contains(key)) return std::nullopt;
    return take<double>(s, key, 0.0);
  }

  void reject_rest(const Section& s, const std::vector<std::string>& known) const {
    if (s.values.empty()) return;
    const std::string& key = s.values.begin()->first;
    throw Error(ErrorKind::BadInput, s.where(key) + ": unknown key" + did_you_mean(key, known));
  }

  void check_name(const std::string& name, const std::string& kind, int line) const {
    static const std::regex pattern("[A-Za-z0-9_-]+");
    if (!std::regex_match(name, pattern))
      fail(line, fmt::format("{} name '{}': only letters, digits, '_' and '-' may be in a name", kind, name));
  }

  void read_camera(const toml::table& table) {
    Section s = flat_section(table, file_, "camera");
    ShotCamera c;
    c.line = s.line;
    c.name = take<std::string>(s, "name", "");
    c.footage = take<std::string>(s, "footage", "");
    c.fps = take_number(s, "fps");
    c.start_s = take_number(s, "start_s");
    c.moving = take<bool>(s, "moving", false);
    c.mask = take<std::string>(s, "mask", "");
    c.trim_start_s = take_number(s, "trim_start_s").value_or(0);
    c.trim_end_s = take_number(s, "trim_end_s");
    c.readout_ms = take_number(s, "readout_ms").value_or(0);
    c.key_color = take<std::string>(s, "key_color", "");
    c.calibration = take<std::string>(s, "calibration", "");
    reject_rest(s, {"name", "footage", "fps", "start_s", "moving", "trim_start_s", "trim_end_s", "readout_ms", "mask",
                    "key_color", "calibration"});
    if (c.name.empty() || c.footage.empty()) fail(c.line, "every [[camera]] needs a name and footage");
    check_name(c.name, "camera", c.line);
    if (c.fps && *c.fps <= 0) fail(c.line, fmt::format("camera '{}': fps is {}, must be above 0", c.name, *c.fps));
    if (c.trim_start_s < 0 || (c.trim_end_s && *c.trim_end_s <= c.trim_start_s))
      fail(c.line, fmt::format("camera '{}': trimmed from {} to {} s, expected 0 <= trim_start_s < trim_end_s", c.name,
                               c.trim_start_s, c.trim_end_s.value_or(0)));
    if (c.readout_ms < 0 || c.readout_ms > 100)
      fail(c.line,
           fmt::format("camera '{}': readout_ms is {}, expected 0 (global shutter) to 100", c.name, c.readout_ms));
    shot_.cameras.push_back(std::move(c));
  }

  void read_render(const toml::table& table) {
    Section s = flat_section(table, file_, "render");
    RenderRequest r;
    r.line = s.line;
    r.name = take<std::string>(s, "name", fmt::format("render{}", shot_.renders.size()));
    check_name(r.name, "render", r.line);
    r.mode = take<std::string>(s, "mode", "view");
    const std::vector<std::string> modes{"view", "stereo", "stereo-depth"};
    if (std::find(modes.begin(), modes.end(), r.mode) == modes.end())
      fail(r.line, fmt::format("render '{}': unknown mode '{}', expected view, stereo or stereo-depth{}", r.name,
                               r.mode, did_you_mean(r.mode, modes)));
    r.fps = take<double>(s, "fps", 30.0);
    r.width = static_cast<int>(take<double>(s, "width", 0));
    r.height = static_cast<int>(take<double>(s, "height", 0));
    if (r.fps <= 0 || r.width < 0 || r.height < 0 || r.width > 16384 || r.height > 16384)
      fail(r.line, fmt::format("render '{}': fps must be above 0, width and height between 0 and 16384", r.name));
    r.views = take<std::string>(s, "views", "");
    read_keyframes(s, r);
    r.options = std::move(s);
    for (const auto& other : shot_.renders)
      if (other.name == r.name) fail(r.line, fmt::format("render '{}' is there twice", r.name));
    shot_.renders.push_back(std::move(r));
  }

  void read_keyframes(Section& s, RenderRequest& r) const {
    const auto found = s.values.find("keyframes");
    if (found == s.values.end()) {
      if (r.views.empty()) fail(r.line, fmt::format("render '{}' needs keyframes or views", r.name));
      return;
    }
    if (!r.views.empty()) fail(r.line, fmt::format("render '{}' has both keyframes and views: keep one", r.name));
    const Json list = found->second.value;
    const int line = found->second.line;
    s.values.erase(found);
    if (!list.is_array() || list.empty())
      fail(line, fmt::format("render '{}': keyframes must be a list of tables", r.name));
    const std::vector<std::string> known{"at_s", "time_s", "azimuth_deg", "elevation_deg"};
    for (const Json& item : list) {
      if (!item.is_object()) fail(line, "every key frame must be a table {at_s, time_s, azimuth_deg, elevation_deg}");
      for (const auto& [key, value] : item.items()) {
        if (std::find(known.begin(), known.end(), key) == known.end())
          fail(line, fmt::format("key frame: unknown key '{}'{}", key, did_you_mean(key, known)));
        if (!value.is_number()) fail(line, fmt::format("key frame: {} is {}, expected a number", key, value.dump()));
      }
      const KeyFrame k{item.value("at_s", 0.0), item.value("time_s", 0.0), item.value("azimuth_deg", 0.0),
                       item.value("elevation_deg", 0.0)};
      if (!r.keyframes.empty() && k.at_s <= r.keyframes.back().at_s)
        fail(line, fmt::format("render '{}': key frames must have rising at_s; {} follows {}", r.name, k.at_s,
                               r.keyframes.back().at_s));
      r.keyframes.push_back(k);
    }
  }

  void check_cameras() const {
    std::set<std::string> names;
    for (const auto& c : shot_.cameras)
      if (!names.insert(c.name).second) fail(c.line, fmt::format("camera '{}' is there twice", c.name));
    if (shot_.cameras.size() < 2)
      throw Error(ErrorKind::BadInput, fmt::format("{}: has {} camera{}, needs two or more to see depth between them",
                                                   file_, shot_.cameras.size(), shot_.cameras.size() == 1 ? "" : "s"));
  }

  fs::path folder_;
  std::string file_;
  const std::vector<std::string>& section_names_;
  Section farm_{.file = file_, .name = "farm", .line = 1, .values = {}};
  Shot shot_;
};

}  // namespace

Shot read_shot(const fs::path& folder, const std::vector<std::string>& section_names) {
  Shot shot;
  with_one_line_errors([&] { shot = Reader(folder, section_names).read(); });
  return shot;
}

}  // namespace vantage
