#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "jobs/views/virtual_view.h"

namespace vantage {

/// Which images of a navigation space a view can make use of.
class ViewImages {
 public:
  explicit ViewImages(const Navspace& navspace);
  /// Of the cameras of the cells and of those beside them (joined to all but one of a cell's, often; two to either side
  /// of a pair): the frames just before and after time_s (one when a frame is at that time; the last two when time_s is
  /// past the footage). Rising.
  std::vector<int> around(const std::vector<NavLocation>& locations, double time_s) const;

 private:
  void add_cameras_of(const NavLocation& location, std::set<std::string>& cameras) const;
  /// cameras, and those beside at least min_joins of them.
  std::set<std::string> with_neighbours(const std::set<std::string>& cameras, std::size_t min_joins) const;
  void add_frames_of(const std::string& camera, double time_s, std::set<int>& images) const;

  const Navspace& navspace_;
  std::map<std::string, std::vector<int>> frames_;           ///< vertices of a camera by time
  std::map<std::string, std::set<std::string>> neighbours_;  ///< cameras beside each other
};

}  // namespace vantage
