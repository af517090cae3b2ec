#include "worker/agent.h"

#include <gtest/gtest.h>
#include <signal.h>

namespace vantage {
namespace {

constexpr std::int64_t kLeaseMs = 15'000;
constexpr std::int64_t kFreeMb = 8'000;  // memory of the machine

AttemptRef ref_of(std::int64_t job) { return {job, 1, 1000 + job}; }

Assignment assignment(std::int64_t job, int cores = 1, int timeout_s = 60) {
  return {.ref = ref_of(job),
          .spec_path = "/spec",
          .spec_hash = "h",
          .log_path = "/log",
          .cores = cores,
          .ram_mb = 100,
          .timeout_s = timeout_s};
}

/// An agent with two slots, and the scheduler's side of the talk.
struct AgentTest : ::testing::Test {
  Agent agent{
      AgentConfig{.worker_id = "w", .incarnation = 5, .host = "h", .pool = "p", .slots = 2, .cores = 4, .ram_mb = 8000},
      {}};
  WorkerOrders orders = orders_of({});

  static WorkerOrders orders_of(std::vector<Assignment> assigned) {
    WorkerOrders o;
    o.worker_id = "w";
    o.incarnation = 5;
    o.epoch = 1;
    o.lease_ms = kLeaseMs;
    o.assigned = std::move(assigned);
    return o;
  }
  Actions order(std::vector<Assignment> assigned, std::int64_t now_ms = 0) {
    orders.assigned = std::move(assigned);
    ++orders.seq;
    orders.report_seq_seen = agent.report({.now_ms = now_ms}).seq;
    return agent.on_orders(orders, now_ms);
  }
  Actions finish(std::int64_t job, std::int64_t now_ms = 0) {
    ChildExit exit;
    exit.ref = ref_of(job);
    exit.has_outcome = true;
    exit.outcome.content = "c";
    return agent.on_child_exit(exit, now_ms);
  }
  Actions die(std::int64_t job, int signal, bool out_of_memory = false, std::int64_t now_ms = 0) {
    ChildExit exit;
    exit.ref = ref_of(job);
    exit.signal = signal;
    exit.out_of_memory = out_of_memory;
    return agent.on_child_exit(exit, now_ms);
  }
  std::vector<std::int64_t> running_jobs() {
    std::vector<std::int64_t> out;
    for (const RunningAttempt& r : agent.report({}).running) out.push_back(r.ref.job_id);
    return out;
  }
};

TEST_F(AgentTest, OrdersStartAsManyAsThereAreSlots) {
  const Actions actions = order({assignment(1), assignment(2), assignment(3)});
  ASSERT_EQ(actions.start.size(), 2U);
  EXPECT_EQ(actions.start[0].ref, ref_of(1));
  EXPECT_EQ(actions.start[1].ref, ref_of(2));
  EXPECT_TRUE(actions.state_changed);
  EXPECT_EQ(running_jobs(), (std::vector<std::int64_t>{1, 2, 3})) << "queued ones are reported, too";
}

TEST_F(AgentTest, RepeatedOrdersStartNothingTwice) {
  order({assignment(1)});
  const Actions again = agent.on_orders(orders, 10);
  EXPECT_TRUE(again.start.empty());
  EXPECT_FALSE(again.state_changed);
}

TEST_F(AgentTest, ExitStartsTheNextAtOnce) {
  order({assignment(1), assignment(2), assignment(3)});
  const Actions actions = finish(1);
  ASSERT_EQ(actions.start.size(), 1U);
  EXPECT_EQ(actions.start[0].ref, ref_of(3));
}

TEST_F(AgentTest, CoresAreNotPromisedTwice) {
  const Actions actions = order({assignment(1, 3), assignment(2, 2)});
  EXPECT_EQ(actions.start.size(), 1U);
  EXPECT_EQ(finish(1).start.size(), 1U);
}

TEST_F(AgentTest, JobLargerThanTheMachineRunsAlone) {
  EXPECT_EQ(order({assignment(1, 64), assignment(2)}).start.size(), 1U);
}

TEST_F(AgentTest, OlderOrdersAndOrdersForAnotherLifeChangeNothing) {
  order({assignment(1)});
  WorkerOrders late = orders;
  late.seq = 0;
  late.assigned.clear();
  EXPECT_TRUE(agent.on_orders(late, 1).signals.empty());
  WorkerOrders other = orders;
  other.seq = 99;
  other.incarnation = 4;
  other.assigned.clear();
  EXPECT_TRUE(agent.on_orders(other, 1).signals.empty());
  EXPECT_EQ(running_jobs().size(), 1U);
  EXPECT_EQ(agent.report({}).orders_seq_seen, orders.seq);
}

TEST_F(AgentTest, AbsenceStopsRunningAndForgetsQueued) {
  order({assignment(1), assignment(2), assignment(3)});
  const Actions actions = order({assignment(2)});
  ASSERT_EQ(actions.signals.size(), 1U);
  EXPECT_EQ(actions.signals[0].ref, ref_of(1));
  EXPECT_EQ(actions.signals[0].signal, SIGTERM);
  EXPECT_EQ(running_jobs(), (std::vector<std::int64_t>{1, 2}));
  die(1, SIGTERM);
  EXPECT_EQ(agent.done_unacked().at(0).outcome, Outcome::Canceled);
}

TEST_F(AgentTest, RestartedSchedulerThatReconcilesKillsNothing) {
  order({assignment(1)});
  orders.epoch = 2;
  orders.seq = 0;
  orders.reconciling = true;
  EXPECT_TRUE(order({}).signals.empty());
  EXPECT_EQ(running_jobs().size(), 1U);
  orders.reconciling = false;
  EXPECT_EQ(order({}).signals.size(), 1U);
}

TEST_F(AgentTest, FinishedIsReportedUntilAcknowledged) {
  order({assignment(1)});
  EXPECT_TRUE(finish(1).outbox_grew);
  ASSERT_EQ(agent.report({}).done_unacked.size(), 1U);
  EXPECT_EQ(agent.report({}).done_unacked[0].content, "c");
  order({assignment(1)});
  EXPECT_EQ(agent.report({}).done_unacked.size(), 1U);
  orders.acked = {ref_of(1)};
  order({});
  EXPECT_TRUE(agent.report({}).done_unacked.empty());
}

TEST_F(AgentTest, FinishedAttemptNeverStartsAgain) {
  order({assignment(1)});
  finish(1);
  EXPECT_TRUE(order({assignment(1)}).start.empty());
  orders.acked = {ref_of(1)};
  EXPECT_TRUE(order({assignment(1)}).start.empty());
  orders.acked.clear();
  EXPECT_TRUE(order({assignment(1)}).start.empty());
}

TEST_F(AgentTest, ResultsOfAnEarlierLifeAreReported) {
  DoneAttempt done;
  done.ref = ref_of(9);
  Agent reborn(AgentConfig{.worker_id = "w", .incarnation = 5, .host = "h", .pool = "p"}, {done});
  ASSERT_EQ(reborn.report({}).done_unacked.size(), 1U);
  EXPECT_EQ(reborn.report({}).done_unacked[0].ref, ref_of(9));
  EXPECT_TRUE(reborn.on_orders(orders_of({assignment(9)}), 0).start.empty());
}

TEST_F(AgentTest, CancelStopsTheChildAndIsReportedAsCanceled) {
  order({assignment(1), assignment(2), assignment(3)});
  orders.canceled = {ref_of(1), ref_of(3)};
  const Actions actions = order({assignment(1), assignment(2), assignment(3)});
  ASSERT_EQ(actions.signals.size(), 1U);
  EXPECT_TRUE(actions.start.empty());
  die(1, SIGTERM);
  ASSERT_EQ(agent.done_unacked().size(), 2U);
  for (const DoneAttempt& d : agent.done_unacked()) EXPECT_EQ(d.outcome, Outcome::Canceled);
}

TEST_F(AgentTest, ResultThatWasCommittedBeforeTheCancelCounts) {
  order({assignment(1)});
  order({});
  finish(1);
  EXPECT_EQ(agent.done_unacked().at(0).outcome, Outcome::Done);
}

TEST_F(AgentTest, CrashIsReportedWithItsSignal) {
  order({assignment(1)});
  die(1, SIGSEGV);
  const DoneAttempt d = agent.done_unacked().at(0);
  EXPECT_EQ(d.outcome, Outcome::Crashed);
  EXPECT_EQ(d.error_kind, "crash");
  EXPECT_EQ(d.signal, SIGSEGV);
  EXPECT_NE(d.message.find("Segmentation fault"), std::string::npos);
}

TEST_F(AgentTest, ExitWithoutAResultIsACrash) {
  order({assignment(1)});
  ChildExit exit;
  exit.ref = ref_of(1);
  exit.exit_code = 3;
  agent.on_child_exit(exit, 0);
  EXPECT_EQ(agent.done_unacked().at(0).outcome, Outcome::Crashed);
  EXPECT_EQ(agent.done_unacked().at(0).exit_code, 3);
}

TEST_F(AgentTest, KernelsOutOfMemoryKillIsAResourceFailure) {
  order({assignment(1)});
  die(1, SIGKILL, true);
  EXPECT_EQ(agent.done_unacked().at(0).outcome, Outcome::Failed);
  EXPECT_EQ(agent.done_unacked().at(0).error_kind, "resource");
}

TEST_F(AgentTest, TimeOutAsksThenKillsThenReportsResource) {
  order({assignment(1, 1, 60)}, 0);
  EXPECT_TRUE(agent.on_tick(59'999, kFreeMb).signals.empty());
  const Actions term = agent.on_tick(60'000, kFreeMb);
  ASSERT_EQ(term.signals.size(), 1U);
  EXPECT_EQ(term.signals[0].signal, SIGTERM);
  EXPECT_TRUE(agent.on_tick(69'999, kFreeMb).signals.empty());
  const Actions kill = agent.on_tick(70'000, kFreeMb);
  ASSERT_EQ(kill.signals.size(), 1U);
  EXPECT_EQ(kill.signals[0].signal, SIGKILL);
  die(1, SIGKILL);
  EXPECT_EQ(agent.done_unacked().at(0).outcome, Outcome::Failed);
  EXPECT_EQ(agent.done_unacked().at(0).error_kind, "resource");
}

TEST_F(AgentTest, FarTooMuchMemoryIsAResourceFailure) {
  order({assignment(1)});
  agent.on_progress({ref_of(1), "warping", 0.5, 600}, 1, 5);
  EXPECT_TRUE(agent.on_tick(5, kFreeMb).signals.empty());
  agent.on_progress({ref_of(1), "warping", 0.5, 601}, 1, 10);
  const Actions actions = agent.on_tick(10, kFreeMb);
  ASSERT_EQ(actions.signals.size(), 1U);
  EXPECT_EQ(actions.signals[0].signal, SIGKILL) << "memory goes faster than a polite request is heard";
  die(1, SIGKILL);
  EXPECT_EQ(agent.done_unacked().at(0).message, "used 601 MB of memory; 100 MB were reserved, the limit is 600 MB");
  EXPECT_EQ(agent.done_unacked().at(0).error_kind, "resource");
}

TEST_F(AgentTest, LostSchedulerLetsRunningGoOnButStartsNothing) {
  order({assignment(1), assignment(2), assignment(3)}, 0);
  EXPECT_TRUE(agent.on_tick(kLeaseMs + 1, kFreeMb).signals.empty());
  EXPECT_TRUE(finish(1, kLeaseMs + 1).start.empty());
  EXPECT_TRUE(agent.on_orders(orders, kLeaseMs + 2).start.empty()) << "orders that waited since then renew nothing";
  EXPECT_EQ(order(orders.assigned, kLeaseMs + 3).start.size(), 1U) << "the scheduler is back";
}

TEST_F(AgentTest, LeaseRunsFromWhenTheAnsweredReportWasSent) {
  const std::int64_t seq = agent.report({.now_ms = 1'000}).seq;
  agent.report({.now_ms = 9'000});
  orders.assigned = {assignment(1)};
  orders.seq = 1;
  orders.report_seq_seen = seq;
  EXPECT_TRUE(agent.on_orders(orders, 1'000 + kLeaseMs + 1).start.empty()) << "stopped for a while, then continued";
  orders.seq = 2;
  orders.report_seq_seen = seq + 1;
  EXPECT_EQ(agent.on_orders(orders, 1'000 + kLeaseMs + 2).start.size(), 1U);
}

TEST_F(AgentTest, ChildWithoutProgressAndProcessorTimeHangs) {
  order({assignment(1, 1, 0)}, 0);
  agent.on_progress({ref_of(1), "warping", 0.5, 10}, 7, 1'000);
  agent.on_progress({ref_of(1), "warping", 0.5, 10}, 8, 500'000);
  agent.on_progress({ref_of(1), "warping", 0.5, 10}, 8, 1'300'000);
  EXPECT_TRUE(agent.on_tick(1'399'999, kFreeMb).signals.empty());
  EXPECT_EQ(agent.on_tick(1'400'000, kFreeMb).signals.size(), 1U);
  die(1, SIGTERM);
  EXPECT_EQ(agent.done_unacked().at(0).message, "hung: no progress and no processor time used for 900 s");
}

TEST_F(AgentTest, FullMachineIsRelievedOfWhoeverExceedsItsReservationMost) {
  order({assignment(1), assignment(2)});
  agent.on_progress({ref_of(1), "", 0, 300}, 1, 0);
  agent.on_progress({ref_of(2), "", 0, 90}, 1, 0);
  EXPECT_TRUE(agent.on_tick(1, 200).signals.empty());
  const Actions actions = agent.on_tick(2, 199);
  ASSERT_EQ(actions.signals.size(), 1U);
  EXPECT_EQ(actions.signals[0].ref, ref_of(1));
  die(1, SIGKILL);
  EXPECT_TRUE(agent.on_tick(3, 100).signals.empty()) << "what keeps to its reservation is not to blame";
}

TEST_F(AgentTest, LostAttemptIsNeitherReportedNorStartedAgain) {
  order({assignment(1), assignment(2), assignment(3)});
  EXPECT_EQ(agent.on_lost({ref_of(1)}, 0).start.size(), 1U);
  EXPECT_EQ(running_jobs(), (std::vector<std::int64_t>{2, 3}));
  EXPECT_TRUE(agent.done_unacked().empty());
  EXPECT_TRUE(order({assignment(1), assignment(2), assignment(3)}).start.empty());
}

TEST_F(AgentTest, TroubleTakesNoWorkUntilItIsOver) {
  EXPECT_TRUE(agent.on_trouble("no disk space left at /store: 12 MB", 0).state_changed);
  EXPECT_TRUE(order({assignment(1)}).start.empty());
  EXPECT_EQ(agent.report({}).trouble, "no disk space left at /store: 12 MB");
  EXPECT_EQ(agent.on_trouble("", 0).start.size(), 1U);
}

TEST_F(AgentTest, OrdersForALaterLifeSayThatSomebodyElseHasOurIdentity) {
  WorkerOrders other = orders;
  other.incarnation = 6;
  other.host = "right-desk";
  EXPECT_EQ(agent.on_orders(other, 0).replaced_by, "right-desk");
  other.incarnation = 4;
  EXPECT_EQ(agent.on_orders(other, 0).replaced_by, "");
}

TEST_F(AgentTest, HundredsOfAttemptsAreTakenInOneGo) {
  std::vector<Assignment> many;
  for (int i = 0; i < 500; ++i) many.push_back(assignment(i));
  order(many);
  for (int i = 0; i < 500; ++i) finish(i);
  EXPECT_EQ(agent.done_unacked().size(), 500U);
  for (int i = 0; i < 500; ++i) orders.acked.push_back(ref_of(i));
  order({});
  EXPECT_TRUE(agent.done_unacked().empty());
}

TEST_F(AgentTest, DrainOrderFinishesWhatRunsAndCanBeTakenBack) {
  order({assignment(1), assignment(2), assignment(3)});
  orders.drain = true;
  order({assignment(1), assignment(2), assignment(3)});
  EXPECT_TRUE(finish(1).start.empty());
  EXPECT_TRUE(agent.report({}).draining);
  EXPECT_FALSE(agent.is_drained());
  orders.drain = false;
  EXPECT_EQ(order({assignment(2), assignment(3)}).start.size(), 1U);
}

TEST_F(AgentTest, DrainRequestEndsWhenTheLastHasFinished) {
  order({assignment(1)});
  agent.on_drain_request();
  EXPECT_FALSE(agent.is_drained());
  EXPECT_TRUE(order({assignment(1), assignment(2)}).start.empty());
  EXPECT_EQ(running_jobs(), (std::vector<std::int64_t>{1})) << "what is not listed can go to another worker";
  finish(1);
  EXPECT_TRUE(agent.is_drained());
  EXPECT_EQ(agent.report({}).done_unacked.size(), 1U);
}

TEST_F(AgentTest, QuitKillsEverything) {
  order({assignment(1), assignment(2)});
  int num_kills = 0;
  for (const SignalChild& s : agent.on_quit_request(0).signals) num_kills += s.signal == SIGKILL ? 1 : 0;
  EXPECT_EQ(num_kills, 2);
}

TEST_F(AgentTest, ProgressChangesTheReport) {
  order({assignment(1)});
  EXPECT_TRUE(agent.on_progress({ref_of(1), "warping", 0.5, 300}, 1, 0).state_changed);
  EXPECT_FALSE(agent.on_progress({ref_of(1), "warping", 0.5, 301}, 1, 0).state_changed)
      << "memory alone can wait a second";
  const RunningAttempt r = agent.report({}).running.at(0);
  EXPECT_EQ(r.phase, "warping");
  EXPECT_EQ(r.rss_mb, 301);
}

}  // namespace
}  // namespace vantage
