#pragma once
#include <filesystem>
#include <utility>

#include "schema/base/error.h"

namespace vantage {

/// A job's key cannot be made yet: its footage is being read.
class FootageUnread : public Error {
 public:
  explicit FootageUnread(std::filesystem::path path)
      : Error(ErrorKind::Transient, path.string() + ": is not read yet"), path_(std::move(path)) {}
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vantage
