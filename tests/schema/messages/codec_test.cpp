#include "schema/messages/codec.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "schema/messages/body.h"
#include "tests/schema/messages/messages_support.h"

namespace vantage {
namespace {

std::string encode_one(const Message& message, std::int64_t incarnation, std::int64_t seq,
                       const Farm& farm = test_farm()) {
  const auto datagrams = encode(message, {"w-1", incarnation, seq}, farm);
  EXPECT_EQ(datagrams.size(), 1U);
  return datagrams.front();
}

WorkerOrders large_orders(int num_assigned) {
  WorkerOrders o = sample_orders();
  for (int i = 0; i < num_assigned; ++i)
    o.assigned.push_back({{i, 1, i * 7},
                          "/shot/.vantage/specs/" + std::to_string(i),
                          "00ff",
                          "/log/" + std::to_string(i),
                          1,
                          1,
                          1,
                          "depth/1",
                          ""});
  return o;
}

TEST(Codec, ReportSurvivesRoundTrip) {
  Decoder decoder(test_farm());
  const auto message = decoder.take(encode_one(sample_report(), 1, 1));
  ASSERT_TRUE(message);
  const auto& r = std::get<WorkerReport>(*message);
  const WorkerReport expected = sample_report();
  EXPECT_EQ(r.worker_id, expected.worker_id);
  EXPECT_EQ(r.incarnation, expected.incarnation);
  EXPECT_EQ(r.seq, expected.seq);
  EXPECT_EQ(r.host, expected.host);
  EXPECT_EQ(r.pool, expected.pool);
  EXPECT_EQ(r.slots, expected.slots);
  EXPECT_EQ(r.cores, expected.cores);
  EXPECT_EQ(r.ram_mb, expected.ram_mb);
  EXPECT_EQ(r.free_disk_mb, expected.free_disk_mb);
  EXPECT_TRUE(r.draining);
  EXPECT_EQ(r.epoch_seen, expected.epoch_seen);
  EXPECT_EQ(r.orders_seq_seen, expected.orders_seq_seen);
  ASSERT_EQ(r.running.size(), 2U);
  EXPECT_EQ(r.running[0].ref, expected.running[0].ref);
  EXPECT_EQ(r.running[0].phase, "warping");
  EXPECT_EQ(r.running[0].progress, 0.25);
  EXPECT_EQ(r.running[0].rss_mb, 812);
  ASSERT_EQ(r.done_unacked.size(), 1U);
  const DoneAttempt& d = r.done_unacked[0];
  EXPECT_EQ(d.ref, expected.done_unacked[0].ref);
  EXPECT_EQ(d.outcome, Outcome::Crashed);
  EXPECT_EQ(d.error_kind, "crash");
  EXPECT_EQ(d.message, "killed by signal 11");
  EXPECT_EQ(d.exit_code, -1);
  EXPECT_EQ(d.signal, 11);
  EXPECT_EQ(d.wall_ms, 61'000);
  EXPECT_EQ(d.peak_rss_mb, 4096);
  EXPECT_EQ(d.damaged_job, "sync/a__b");
  EXPECT_EQ(r.tags, expected.tags);
  EXPECT_EQ(r.kinds, expected.kinds);
  EXPECT_EQ(r.wall_ms, expected.wall_ms);
  EXPECT_EQ(r.build, "0.1.0");
  EXPECT_EQ(r.trouble, "disk full: /store has 12 MB");
  EXPECT_EQ(r.num_dropped, 17);
}

TEST(Codec, OrdersSurviveRoundTrip) {
  Decoder decoder(test_farm());
  const auto message = decoder.take(encode_one(sample_orders(), 1, 1));
  ASSERT_TRUE(message);
  const auto& o = std::get<WorkerOrders>(*message);
  const WorkerOrders expected = sample_orders();
  EXPECT_EQ(o.worker_id, expected.worker_id);
  EXPECT_EQ(o.incarnation, expected.incarnation);
  EXPECT_EQ(o.epoch, expected.epoch);
  EXPECT_EQ(o.seq, expected.seq);
  EXPECT_EQ(o.lease_ms, expected.lease_ms);
  EXPECT_TRUE(o.reconciling);
  EXPECT_TRUE(o.drain);
  ASSERT_EQ(o.assigned.size(), 1U);
  EXPECT_EQ(o.assigned[0].ref, expected.assigned[0].ref);
  EXPECT_EQ(o.assigned[0].spec_path, expected.assigned[0].spec_path);
  EXPECT_EQ(o.assigned[0].spec_hash, expected.assigned[0].spec_hash);
  EXPECT_EQ(o.assigned[0].log_path, expected.assigned[0].log_path);
  EXPECT_EQ(o.assigned[0].cores, 4);
  EXPECT_EQ(o.assigned[0].ram_mb, 3000);
  EXPECT_EQ(o.assigned[0].timeout_s, 600);
  EXPECT_EQ(o.assigned[0].kind, "depth/1");
  EXPECT_EQ(o.assigned[0].spec, R"({"unit":{"image":3}})");
  EXPECT_EQ(o.report_seq_seen, 123);
  EXPECT_EQ(o.host, "left-desk");
  EXPECT_EQ(o.canceled, expected.canceled);
  EXPECT_EQ(o.acked, expected.acked);
}

TEST(Codec, HelloSurvivesRoundTrip) {
  Decoder decoder(test_farm());
  const auto message = decoder.take(encode_one(SchedulerHello{"farm", 3, "127.0.0.1:8080", true}, 3, 1));
  ASSERT_TRUE(message);
  const auto& h = std::get<SchedulerHello>(*message);
  EXPECT_EQ(h.farm_id, "farm");
  EXPECT_EQ(h.epoch, 3);
  EXPECT_EQ(h.http_address, "127.0.0.1:8080");
  EXPECT_TRUE(h.reconciling);
}

TEST(Codec, EveryFlippedBitIsRejected) {
  const std::string datagram = encode_one(sample_report(), 1, 1);
  Decoder decoder(test_farm());
  for (std::size_t bit = 0; bit < 8 * datagram.size(); ++bit) {
    std::string bad = datagram;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_FALSE(decoder.take(bad)) << "bit " << bit;
  }
  EXPECT_EQ(decoder.drops().total(), static_cast<std::int64_t>(8 * datagram.size()));
  EXPECT_TRUE(decoder.take(datagram));
}

TEST(Codec, TruncatedAndEmptyDatagramsAreDropped) {
  const std::string datagram = encode_one(sample_report(), 1, 1);
  Decoder decoder(test_farm());
  for (std::size_t n = 0; n < datagram.size(); ++n) EXPECT_FALSE(decoder.take(datagram.substr(0, n)));
  EXPECT_FALSE(decoder.take(std::string(kMaxDatagramBytes + 1, 'x')));
}

TEST(Codec, ForeignFarmIsDroppedAndCounted) {
  Decoder decoder(test_farm());
  EXPECT_FALSE(decoder.take(encode_one(sample_report(), 1, 1, farm_of_key("the key of the farm next door"))));
  EXPECT_EQ(decoder.drops().foreign, 1);
  const Farm impostor{test_farm().id, "knows the id but not the key"};
  EXPECT_FALSE(decoder.take(encode_one(sample_report(), 1, 1, impostor)));
  EXPECT_EQ(decoder.drops().bad_mac, 1);
}

TEST(Codec, OlderAndRepeatedStatesAreDropped) {
  Decoder decoder(test_farm());
  const std::string fourth = encode_one(sample_report(), 2, 4);
  EXPECT_TRUE(decoder.take(fourth));
  EXPECT_FALSE(decoder.take(fourth));
  EXPECT_FALSE(decoder.take(encode_one(sample_report(), 2, 3)));
  EXPECT_FALSE(decoder.take(encode_one(sample_report(), 1, 900)));
  EXPECT_EQ(decoder.drops().older, 3);
  EXPECT_TRUE(decoder.take(encode_one(sample_report(), 2, 5)));
  EXPECT_TRUE(decoder.take(encode_one(sample_report(), 3, 1)));
}

TEST(Codec, KindsOfMessagesAreOrderedEachForItself) {
  Decoder decoder(test_farm());
  EXPECT_TRUE(decoder.take(encode_one(SchedulerHello{}, 1, 2)));
  EXPECT_TRUE(decoder.take(encode_one(sample_orders(), 1, 1)));
}

TEST(Codec, OtherProtocolVersionIsCounted) {
  std::string datagram = encode_one(sample_report(), 1, 1);
  datagram[5] = static_cast<char>(kProtocolVersion + 1);
  Decoder decoder(test_farm());
  EXPECT_FALSE(decoder.take(datagram));
  EXPECT_EQ(decoder.drops().version, 1);
  ASSERT_TRUE(decoder.other_version());
  EXPECT_EQ(decoder.other_version()->version, kProtocolVersion + 1);
  EXPECT_EQ(decoder.other_version()->sender, "w-1");
}

TEST(Codec, LargeStateTravelsInPagesInAnyOrder) {
  auto pages = encode(large_orders(3000), {"scheduler", 1, 1}, test_farm());
  ASSERT_GT(pages.size(), 2U);
  for (const auto& page : pages) EXPECT_LE(page.size(), kMaxDatagramBytes);
  std::reverse(pages.begin(), pages.end());
  Decoder decoder(test_farm());
  for (std::size_t i = 0; i + 1 < pages.size(); ++i) {
    EXPECT_FALSE(decoder.take(pages[i]));
    EXPECT_FALSE(decoder.take(pages[i])) << "a repeated page";
  }
  const auto message = decoder.take(pages.back());
  ASSERT_TRUE(message);
  EXPECT_EQ(std::get<WorkerOrders>(*message).assigned.size(), 3001U);
  EXPECT_EQ(std::get<WorkerOrders>(*message).assigned[2500].spec_path, "/shot/.vantage/specs/2499");
}

TEST(Codec, StateWithALostPageIsReplacedByTheNext) {
  const auto first = encode(large_orders(3000), {"scheduler", 1, 1}, test_farm());
  const auto second = encode(large_orders(3000), {"scheduler", 1, 2}, test_farm());
  Decoder decoder(test_farm());
  EXPECT_FALSE(decoder.take(first[0]));
  std::optional<Message> message;
  for (const auto& page : second) message = decoder.take(page);
  EXPECT_TRUE(message);
  EXPECT_FALSE(decoder.take(first[1]));
  EXPECT_EQ(decoder.drops().older, 1);
}

TEST(Codec, AbsurdCountsInABodyAllocateNothing) {
  std::string body = encode_body(sample_report());
  ASSERT_TRUE(decode_body(0, body));
  for (const std::size_t at : {8U, 12U, 16U, 20U}) {
    std::string bad = body;
    bad.replace(at, 4, "\x7f\xff\xff\xff");
    EXPECT_FALSE(decode_body(0, bad));
    bad.replace(at, 4, std::string(4, '\xff'));
    EXPECT_FALSE(decode_body(0, bad));
  }
  EXPECT_FALSE(decode_body(1, body)) << "a report is no orders";
  EXPECT_FALSE(decode_body(9, body));
}

TEST(Codec, DamagedBodiesNeverThrow) {
  const std::string body = encode_body(sample_orders());
  std::uint32_t state = 1;
  for (int round = 0; round < 20'000; ++round) {
    std::string bad = body;
    for (int k = 0; k < 3; ++k) {
      state = state * 1664525U + 1013904223U;
      bad[(state >> 8U) % bad.size()] = static_cast<char>(state >> 24U);
    }
    EXPECT_NO_THROW(decode_body(1, bad));
  }
}

TEST(Farm, KeyFileIsMadeOnceAndPrivate) {
  const std::string folder = ::testing::TempDir() + "/farm-" + to_hex(random_bytes(4));
  const Farm made = read_or_create_farm_key(folder + "/farm.key");
  EXPECT_EQ(read_or_create_farm_key(folder + "/farm.key").id, made.id);
  EXPECT_EQ(read_farm_key(folder + "/farm.key").key, made.key);
  EXPECT_EQ(std::filesystem::status(folder + "/farm.key").permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  std::filesystem::remove_all(folder);
}

TEST(Farm, KeyFileThatOthersCanReadIsRefusedWithTheRemedy) {
  const std::string folder = ::testing::TempDir() + "/farm-" + to_hex(random_bytes(4));
  read_or_create_farm_key(folder + "/farm.key");
  for (const auto others : {std::filesystem::perms::group_read, std::filesystem::perms::others_read}) {
    std::filesystem::permissions(folder + "/farm.key", std::filesystem::perms::owner_read | others);
    try {
      read_farm_key(folder + "/farm.key");
      FAIL() << "accepted";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      EXPECT_NE(std::string(e.what()).find("chmod 600 " + folder + "/farm.key"), std::string::npos) << e.what();
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(Farm, ShortKeyIsBadInput) {
  try {
    farm_of_key("secret");
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
  }
}

}  // namespace
}  // namespace vantage
