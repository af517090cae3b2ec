#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// A running program that is fed through its standard input. It is killed when this object goes away before finish()
/// (an error on our side must not leave a file that looks whole) or when the calling thread ends.
class ProgramSink {
 public:
  /// argv[0] is looked up in PATH; its output is appended to stderr_file. Throws Error(Resource) when it cannot be
  /// started.
  ProgramSink(const std::vector<std::string>& argv, const std::filesystem::path& stderr_file);
  ~ProgramSink();
  ProgramSink(const ProgramSink&) = delete;
  ProgramSink& operator=(const ProgramSink&) = delete;

  /// False when the program takes no more: finish() says how it ended. Throws Error(Transient).
  bool write(const char* bytes, std::size_t num);
  /// Ends its input and waits: its exit status, 128 + signal when a signal ended it. Throws Error(Resource) when it is
  /// not installed.
  int finish();

 private:
  int fd_ = -1;
  pid_t pid_ = -1;
  std::string name_;
};

}  // namespace vantage
