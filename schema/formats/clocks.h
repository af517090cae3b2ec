#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vantage {

/// t_shot = offset_s + rate * t_footage, t_footage being the time since the camera's first frame.
struct CameraClock {
  std::string name;
  double offset_s = 0;
  double rate = 1;
  double offset_std_s = 0;
  double rate_std = 0;  ///< 0: no pair could tell the rate, which is taken from its neighbours or is 1
  double shot_time_s(double footage_time_s) const { return offset_s + rate * footage_time_s; }
};

/// clocks.json. Cameras that could not be tied to the reference are not in it.
struct Clocks {
  std::string reference;
  std::vector<CameraClock> cameras;
  const CameraClock* find(const std::string& camera) const;  ///< nullptr when there is none
};

Clocks read_clocks(const std::filesystem::path& align_artifact);
void write_clocks(const std::filesystem::path& file, const Clocks& clocks);

/// offset.json of a sync artifact: how far camera b's clock is behind camera a's.
struct PairOffset {
  std::string a, b;
  double offset_s = 0;      ///< shot time of b's first frame minus shot time of a's first frame
  double rate = 1;          ///< seconds of a's footage per second of b's: t_a = offset_s + rate * t_b
  double std_s = 0;         ///< one standard deviation of offset_s + rate · pivot_b_s
  bool determined = false;  ///< false: could not tell; the other numbers are then only the best guess
  std::string method;       ///< "motion", "audio", …
  int num_inliers = 0;
  std::string verdict;   ///< a sentence for people
  double rate_std = 0;   ///< one standard deviation of rate; 0: not estimated, 1 is assumed
  double pivot_b_s = 0;  ///< moment of b's footage at which errors of offset and rate are independent
};

PairOffset read_pair_offset(const std::filesystem::path& sync_artifact);
void write_pair_offset(const std::filesystem::path& file, const PairOffset& offset);

}  // namespace vantage
