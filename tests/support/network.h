#pragma once
/// Several hosts on one machine: a network namespace each, joined by cables (veth). Needs root.
#include <functional>
#include <string>

namespace vantage {

/// Runs fn in a thread that has moved to the network namespace; here when it has no name. What fn throws comes through.
void in_netns(const std::string& name, const std::function<void()>& fn);

class Network {
 public:
  enum class Middle {
    Bridge,  ///< a switch: the kernel's
    Nothing  ///< the cables end in ports port0, port1, … of the namespace middle(): a relay of the test joins them
  };
  /// Throws Error(Resource) when namespaces or cables cannot be made.
  Network(int num_hosts, Middle middle);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  /// Why there can be no networks here; empty when they can be made.
  static std::string why_not();

  std::string host(int index) const;  ///< name of its namespace; multicast goes to its cable
  std::string address(int index) const;
  std::string middle() const { return prefix_ + "m"; }
  /// Of what the host receives over the cable, so many of a hundred packets are lost; 100 cuts it off both ways.
  void set_loss(int host, int percent);

 private:
  void lay_cable(int index);

  std::string prefix_;
  int num_hosts_;
  Middle kind_;
};

}  // namespace vantage
