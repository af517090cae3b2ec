#include <fmt/format.h>

#include "scheduler/store/store.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::int64_t kKeptMs = 24LL * 3600 * 1000;

}  // namespace

std::optional<std::string> Store::kept_answer(const OnceKey& once) {
  Query q = db_.query("SELECT fingerprint, answer FROM kept_answer WHERE who = ? AND key = ? AND at_ms > ?", once.who,
                      once.key, clock_.wall_ms() - kKeptMs);
  if (!q.step()) return std::nullopt;
  if (q.text(0) != once.fingerprint)
    throw KeyReused(
        fmt::format("Idempotency-Key '{}' was used for another request; every order needs its own", once.key));
  return q.text(1);
}

void Store::keep_answer(const OnceKey& once, const std::string& answer) {
  db_.run("DELETE FROM kept_answer WHERE at_ms <= ?", clock_.wall_ms() - kKeptMs);
  db_.run("INSERT OR REPLACE INTO kept_answer (who, key, fingerprint, answer, at_ms) VALUES (?, ?, ?, ?, ?)", once.who,
          once.key, once.fingerprint, answer, clock_.wall_ms());
}

}  // namespace vantage
