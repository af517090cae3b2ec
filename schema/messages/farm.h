#pragma once
#include <filesystem>
#include <string>

namespace vantage {

/// What makes machines one farm: a shared secret. Its id follows from the key, so there is nothing else to agree on.
struct Farm {
  std::string id;   ///< 16 hex digits; says nothing of the key
  std::string key;  ///< signs every message
};

/// The farm of a key. Throws Error(BadInput) when the key has fewer than 16 characters.
Farm farm_of_key(const std::string& key);
/// The first line of a key file. Throws Error(BadInput) naming the file, also when others than its owner may read it.
Farm read_farm_key(const std::filesystem::path& path);
/// Makes the file with a random key, readable by its owner only, when it is not there yet.
Farm read_or_create_farm_key(const std::filesystem::path& path);

}  // namespace vantage
