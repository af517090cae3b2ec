#include "scheduler/api/job_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "schema/base/error.h"

namespace vantage {
namespace {

using Words = std::vector<std::string>;

constexpr int kMaxNamesPerCall = 20'000;

/// The list's order. Within a group by number, which is the order of planning.
struct Group {
  Words states;
  bool newest_first = false;
};
const std::array<Group, 5>& groups() {
  static const std::array<Group, 5> all{{{{"running", "leased", "reconnect"}},
                                         {{"failed", "quarantined"}},
                                         {{"ready"}},
                                         {{"done", "skipped"}, true},
                                         {{"blocked", "paused", "aborted", "canceled"}}}};
  return all;
}

/// The last job of the page before: "group-id", or "name=…" in a list by name.
struct Place {
  std::size_t group = 0;
  std::int64_t id = 0;  ///< 0: the group's beginning
};

Place parse_place(const std::string& text) {
  if (text.empty()) return {};
  Place place;
  const char* const end = text.data() + text.size();
  const auto [dash, bad_group] = std::from_chars(text.data(), end, place.group);
  if (bad_group == std::errc{} && dash != end && *dash == '-' && place.group < groups().size()) {
    const auto [rest, bad_id] = std::from_chars(dash + 1, end, place.id);
    if (bad_id == std::errc{} && rest == end && place.id > 0) return place;
  }
  throw Error(ErrorKind::BadInput, fmt::format("after is '{}', expected what the page before said", text));
}

Words split_words(const std::string& text) {
  Words words;
  for (std::size_t start = 0; start < text.size();) {
    const auto comma = std::min(text.find(',', start), text.size());
    words.push_back(text.substr(start, comma - start));
    start = comma + 1;
  }
  return words;
}

bool allows(const Words& wanted, const std::string& word) {
  return wanted.empty() || std::find(wanted.begin(), wanted.end(), word) != wanted.end();
}

/// One seek per kind instead of a look at every job.
Words kinds_of(Sqlite& db, std::int64_t shot_id, std::int64_t generation) {
  Words kinds;
  for (std::string last;;) {
    last = db.text_or("", "SELECT min(kind) FROM job WHERE shot_id = ? AND generation = ? AND kind > ?", shot_id,
                      generation, last);
    if (last.empty()) return kinds;
    kinds.push_back(last);
  }
}

/// Up to `limit` jobs of a group beyond `id`: each kind and state is one stretch of the index job_by_kind, in order.
std::vector<std::int64_t> read_group(Sqlite& db, std::int64_t shot_id, std::int64_t generation, const Words& kinds,
                                     const Words& states, bool newest_first, std::int64_t id, std::int64_t limit) {
  static const std::string beginning =
      "SELECT id FROM job WHERE shot_id = ? AND generation = ? AND kind = ? AND state = ? ";
  static const std::string up = beginning + "AND id > ? ORDER BY id LIMIT ?";
  static const std::string down = beginning + "AND id < ? ORDER BY id DESC LIMIT ?";
  if (newest_first && id == 0) id = INT64_MAX;
  std::vector<std::int64_t> ids;
  for (const auto& kind : kinds)
    for (const auto& state : states)
      for (auto row = db.query(newest_first ? down : up, shot_id, generation, kind, state, id, limit); row.step();)
        ids.push_back(row.integer(0));
  if (newest_first)
    std::sort(ids.begin(), ids.end(), std::greater<>());
  else
    std::sort(ids.begin(), ids.end());
  if (static_cast<std::int64_t>(ids.size()) > limit) ids.resize(static_cast<std::size_t>(limit));
  return ids;
}

JobPage page_by_state(Sqlite& db, std::int64_t shot_id, std::int64_t generation, const JobFilter& filter) {
  const Words kinds = filter.kind.empty() ? kinds_of(db, shot_id, generation) : Words{filter.kind};
  const Words wanted = split_words(filter.states);
  Place place = parse_place(filter.after);
  JobPage page;
  for (; place.group < groups().size(); place = {place.group + 1, 0}) {
    const Group& group = groups().at(place.group);
    Words states;
    for (const auto& state : group.states)
      if (allows(wanted, state)) states.push_back(state);
    const std::int64_t left = filter.limit - static_cast<std::int64_t>(page.ids.size());
    for (const auto id : read_group(db, shot_id, generation, kinds, states, group.newest_first, place.id, left))
      page.ids.push_back(id);
    if (static_cast<std::int64_t>(page.ids.size()) < filter.limit) continue;
    if (!page.ids.empty()) page.after = fmt::format("{}-{}", place.group, page.ids.back());
    break;
  }
  return page;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

constexpr std::string_view kByName = "name=";

JobPage page_by_name(Sqlite& db, std::int64_t shot_id, std::int64_t generation, const JobFilter& filter) {
  const Words states = split_words(filter.states);
  const std::string text = lower(filter.text);
  if (!filter.after.empty() && !filter.after.starts_with(kByName)) parse_place("by name");
  std::string last = filter.after.empty() ? "" : filter.after.substr(kByName.size());
  JobPage page;
  int num_seen = 0;
  bool more = filter.limit > 0;
  for (auto row = db.query("SELECT id, name FROM job WHERE shot_id = ? AND name > ? ORDER BY name", shot_id, last);
       more && (more = row.step());) {
    last = row.text(1);
    if (lower(last).find(text) != std::string::npos) {
      auto job = db.query("SELECT generation, kind, state FROM job WHERE id = ?", row.integer(0));
      if (job.step() && job.integer(0) == generation && (filter.kind.empty() || job.text(1) == filter.kind) &&
          allows(states, job.text(2)))
        page.ids.push_back(row.integer(0));
    }
    if (++num_seen == kMaxNamesPerCall || static_cast<std::int64_t>(page.ids.size()) == filter.limit) break;
  }
  if (more) page.after = std::string(kByName) + last;
  return page;
}

JobPage page_of_one(Sqlite& db, std::int64_t shot_id, std::int64_t generation, const JobFilter& filter) {
  JobPage page;
  for (auto row = db.query("SELECT id FROM job WHERE shot_id = ? AND name = ? AND generation = ?", shot_id, filter.name,
                           generation);
       row.step();)
    page.ids.push_back(row.integer(0));
  return page;
}

}  // namespace

JobPage read_job_page(Sqlite& db, std::int64_t shot_id, const JobFilter& filter) {
  const auto generation = db.integer_or(0, "SELECT generation FROM shot WHERE id = ?", shot_id);
  if (!filter.name.empty()) return page_of_one(db, shot_id, generation, filter);
  if (!filter.text.empty()) return page_by_name(db, shot_id, generation, filter);
  return page_by_state(db, shot_id, generation, filter);
}

}  // namespace vantage
