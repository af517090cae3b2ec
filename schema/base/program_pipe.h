#pragma once
#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// A program that runs beside us and whose standard output we read as it comes. Like run_program() otherwise; it is
/// killed when this object goes away before its end. One thread uses it.
class ProgramPipe {
 public:
  /// stderr_file: appended to. Throws Error(Resource) when no process can be started.
  ProgramPipe(const std::vector<std::string>& argv, const std::filesystem::path& stderr_file);
  ~ProgramPipe();
  ProgramPipe(const ProgramPipe&) = delete;
  ProgramPipe& operator=(const ProgramPipe&) = delete;

  /// Waits for that many bytes; fewer only at the end of the output. Returns how many came.
  std::size_t read(char* bytes, std::size_t num);
  /// Exit status, once the output has come to its end. Throws Error(Resource) when the program is not installed.
  int wait();

 private:
  std::string name_;
  int fd_ = -1;
  pid_t pid_ = -1;
};

}  // namespace vantage
