#pragma once
#include "schema/messages/protocol.h"

namespace vantage {

/// Where the dispatcher says what it wants. What is sent may be lost.
class Bus {
 public:
  virtual ~Bus() = default;
  virtual void send(const WorkerOrders& orders) = 0;
  virtual void send(const SchedulerHello& hello) = 0;
};

}  // namespace vantage
