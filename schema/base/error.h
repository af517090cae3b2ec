#pragma once
#include <source_location>
#include <stdexcept>
#include <string>
#include <string_view>

namespace vantage {

/// Why something failed, and so what to do about it.
enum class ErrorKind {
  BadInput,   ///< the person's input is wrong: say so, never retry
  Transient,  ///< the world was briefly in the way (I/O, lost lease): retry with back-off
  Resource,   ///< out of memory, disk or time: retry with more, or elsewhere
  Crash,      ///< the process died: retry alone
  Bug,        ///< we are wrong: never retry
};

std::string_view to_string(ErrorKind kind);
/// Inverse of to_string; Bug for an unknown word.
ErrorKind error_kind_from(std::string_view word);

/// The message says what, where, found and expected, in one line.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }

 private:
  ErrorKind kind_;
};

/// Throws Error(Bug) when cond is false: for what must hold if our own code is right.
void check(bool cond, std::string_view why_it_must_hold, std::source_location where = std::source_location::current());

}  // namespace vantage
