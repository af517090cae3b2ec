#pragma once
/// SHOT/out: what people use, as relative links into the store.
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "scheduler/store/rows.h"
#include "scheduler/store/store.h"

namespace vantage {

/// A link below SHOT/out and the file of the store that it points to.
struct PublishedLink {
  std::filesystem::path link;    ///< absolute
  std::filesystem::path target;  ///< relative to the link's folder
};

/// The links of a job that is done. An OutLink whose 'from' ends in '/' ("./" for the whole artifact) stands for all
/// files below that folder; a file that the artifact does not have is left out.
std::vector<PublishedLink> links_of(const std::filesystem::path& shot_folder, const JobRow& job);

/// Makes these links. A person's own file or link in the way stays; its path is returned.
std::vector<std::filesystem::path> make_links(const std::vector<PublishedLink>& links, const std::string& job_name);

/// Makes the links of one job.
std::vector<std::filesystem::path> publish_job(const std::filesystem::path& shot_folder, const JobRow& job);

/// Makes the links of all done jobs of the shot's plan; with sweep, removes links into the store that no job of the
/// plan owns, and the folders that this leaves empty. Never touches anything but such links.
void publish_shot(Store& store, ShotId shot, bool sweep);

}  // namespace vantage
