#pragma once
/// Bodies of messages: protocol.h's plain values as LCM-encoded bytes and back. Private to this folder.
#include <optional>
#include <string>
#include <string_view>

#include "schema/messages/codec.h"

namespace vantage {

/// LCM bytes, fingerprint first.
std::string encode_body(const Message& message);

/// kind: Message::index(). Empty when the bytes are not exactly one message of that kind. Counts are checked against
/// the number of bytes before any array is made, since LCM's generated code believes them.
std::optional<Message> decode_body(int kind, std::string_view bytes);

}  // namespace vantage
