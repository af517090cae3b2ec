#pragma once
#include <functional>
#include <string>
#include <vector>

#include "scheduler/report/report.h"

namespace vantage::report {

/// Jobs of a kind that have an artifact, in the input's order.
std::vector<const ReportJob*> finished(const ReportInput& input, const std::string& kind);
/// Artifact of a finished job by name; empty when there is none.
std::filesystem::path artifact_of(const ReportInput& input, const std::string& name);
/// What the job's manifest says for people; an empty object when it cannot be read.
Json figures_of(const std::filesystem::path& artifact);
/// At most `count` of the items, spread evenly.
std::vector<const ReportJob*> sample(const std::vector<const ReportJob*>& jobs, std::size_t count);
std::filesystem::path page_folder(const ReportInput& input);
/// Place of a camera in the shot: which colour it has on the page. The number of cameras when it is none of them.
std::size_t camera_index(const ReportInput& input, const std::string& name);

/// Each gives HTML, empty while there is nothing to show.
std::string films(const ReportInput& input);
std::string footage(const ReportInput& input);
std::string calibration(const ReportInput& input);
std::string clocks(const ReportInput& input);
std::string navspace(const ReportInput& input);
std::string correspondence(const ReportInput& input);
std::string depth(const ReportInput& input);
std::string frames(const ReportInput& input);
std::string pictures(const ReportInput& input, const std::string& kind, std::size_t count);
std::string model(const ReportInput& input);
std::string failures(const ReportInput& input);
std::string warnings(const ReportInput& input);
std::string cost(const ReportInput& input);

}  // namespace vantage::report
