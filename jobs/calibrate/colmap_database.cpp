#include "jobs/calibrate/colmap_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <memory>
#include <span>

#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMaxImages = 2147483647;  // COLMAP's pair_id = a * this + b, a < b
constexpr int kUncalibrated = 3;                 // its kind of two-view geometry: only F is known

/// The open database: statements by text, any failure is an Error.
class Database {
 public:
  explicit Database(const fs::path& file) : file_(file) {
    sqlite3* db = nullptr;
    const int status = sqlite3_open_v2(file.c_str(), &db, SQLITE_OPEN_READWRITE, nullptr);
    db_.reset(db);
    if (status != SQLITE_OK) fail();
  }
  void run(const char* sql) {
    if (sqlite3_exec(db_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail();
  }
  [[noreturn]] void fail() const {
    throw Error(ErrorKind::Resource,
                fmt::format("{}: {}; is the disk full?", file_.string(), sqlite3_errmsg(db_.get())));
  }
  sqlite3* handle() const { return db_.get(); }

 private:
  fs::path file_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> db_{nullptr, sqlite3_close};
};

/// An INSERT of one row; values from left to right.
class Row {
 public:
  Row(const Database& database, const char* sql) : database_(database) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database.handle(), sql, -1, &statement, nullptr) != SQLITE_OK) database.fail();
    statement_.reset(statement);
  }
  Row& operator<<(std::int64_t value) {
    sqlite3_bind_int64(statement_.get(), ++num_values_, value);
    return *this;
  }
  Row& operator<<(const std::string& value) {
    sqlite3_bind_text(statement_.get(), ++num_values_, value.c_str(), -1, SQLITE_TRANSIENT);
    return *this;
  }
  template <class T>
  Row& operator<<(std::span<const T> values) {
    sqlite3_bind_blob64(statement_.get(), ++num_values_, values.data(), values.size_bytes(), SQLITE_TRANSIENT);
    return *this;
  }
  void insert() {
    if (sqlite3_step(statement_.get()) != SQLITE_DONE) database_.fail();
  }

 private:
  const Database& database_;
  std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_{nullptr, sqlite3_finalize};
  int num_values_ = 0;
};

/// COLMAP's number of a lens model.
int model_number(const std::string& model) {
  const std::map<std::string, int> numbers{
      {"SIMPLE_PINHOLE", 0}, {"PINHOLE", 1}, {"SIMPLE_RADIAL", 2}, {"RADIAL", 3}, {"OPENCV", 4}};
  const auto found = numbers.find(model);
  check(found != numbers.end(), "only models that a person may choose are mapped with: " + model);
  return found->second;
}

std::map<std::string, int> insert_cameras(const Database& db, const std::map<std::string, LensModel>& lenses) {
  std::map<std::string, int> ids;
  for (const auto& [name, lens] : lenses) {
    const int id = static_cast<int>(ids.size()) + 1;
    ids[name] = id;
    Row row(db, "INSERT INTO cameras VALUES (?, ?, ?, ?, ?, 0)");
    (row << id << model_number(lens.model) << lens.width << lens.height << std::span<const double>(lens.params))
        .insert();
  }
  return ids;
}

void insert_picture(const Database& db, int id, const Survey::Picture& picture, int camera) {
  Row image(db, "INSERT INTO images (image_id, name, camera_id) VALUES (?, ?, ?)");
  (image << id << picture.name() << camera).insert();
  std::vector<float> px;
  for (const auto& glimpse : picture.glimpses)
    for (const auto& p : glimpse.features.px) {
      px.push_back(static_cast<float>(p.x()));
      px.push_back(static_cast<float>(p.y()));
    }
  Row keypoints(db, "INSERT INTO keypoints VALUES (?, ?, 2, ?)");
  (keypoints << id << static_cast<std::int64_t>(px.size() / 2) << std::span<const float>(px)).insert();
}

void insert_pair(const Database& db, const PicturePair& pair) {
  std::vector<std::uint32_t> indices;
  for (const auto& m : pair.matches) {
    indices.push_back(static_cast<std::uint32_t>(m.a));
    indices.push_back(static_cast<std::uint32_t>(m.b));
  }
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> F = pair.F;
  Row row(db, "INSERT INTO two_view_geometries (pair_id, rows, cols, data, config, F) VALUES (?, ?, 2, ?, ?, ?)");
  (row << (pair.a + 1) * kMaxImages + pair.b + 1 << static_cast<std::int64_t>(pair.matches.size())
       << std::span<const std::uint32_t>(indices) << kUncalibrated << std::span<const double>(F.data(), 9))
      .insert();
}

}  // namespace

void fill_colmap_database(const fs::path& file, const std::map<std::string, LensModel>& lenses, const Survey& survey,
                          const std::vector<PicturePair>& pairs) {
  Database db(file);
  db.run("BEGIN");
  const auto camera_ids = insert_cameras(db, lenses);
  int id = 0;
  for (const auto& picture : survey.pictures) insert_picture(db, ++id, picture, camera_ids.at(picture.image.camera));
  for (const auto& pair : pairs)
    if (!pair.matches.empty()) insert_pair(db, pair);
  db.run("COMMIT");
}

}  // namespace vantage
