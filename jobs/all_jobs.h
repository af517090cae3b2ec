#pragma once
/// The one list of job kinds, in the order of the pipeline. Everything that must know them all walks this list.
#include "jobs/align/align_job.h"
#include "jobs/calibrate/calibrate_job.h"
#include "jobs/correspond/correspond_job.h"
#include "jobs/depth/depth_job.h"
#include "jobs/encode/encode_job.h"
#include "jobs/fuse/fuse_job.h"
#include "jobs/ingest/ingest_job.h"
#include "jobs/kind_entry.h"
#include "jobs/navspace/navspace_job.h"
#include "jobs/reconstruct/reconstruct_job.h"
#include "jobs/render/render_job.h"
#include "jobs/sync/sync_job.h"
#include "jobs/track/track_job.h"

namespace vantage {

using AllJobs = JobList<IngestJob, CalibrateJob, TrackJob, SyncJob, AlignJob, NavspaceJob, CorrespondJob, DepthJob,
                        RenderJob, EncodeJob, ReconstructJob, FuseJob>;

const std::vector<KindEntry>& all_kinds();
/// nullptr when there is no such kind.
const KindEntry* find_kind(const std::string& name);
/// Names in the order of the pipeline: tables that may stand in shot.toml.
std::vector<std::string> kind_names(const std::vector<KindEntry>& kinds = all_kinds());

}  // namespace vantage
