#pragma once
#include "scheduler/cli/command_table.h"

namespace vantage {

int init_command(const Arguments& arguments);
int check_command(const Arguments& arguments);
int run_shot_command(const Arguments& arguments);
int farm_command(const Arguments& arguments);
int gc_command(const Arguments& arguments);
int verify_command(const Arguments& arguments);
int backup_command(const Arguments& arguments);
int restore_command(const Arguments& arguments);
int archive_command(const Arguments& arguments);
int doctor_command(const Arguments& arguments);
int scheduler_command(const Arguments& arguments);
int submit_command(const Arguments& arguments);
int status_command(const Arguments& arguments);
int jobs_command(const Arguments& arguments);
int logs_command(const Arguments& arguments);
int why_command(const Arguments& arguments);
int workers_command(const Arguments& arguments);
int drain_command(const Arguments& arguments);
int undrain_command(const Arguments& arguments);
int rerun_command(const Arguments& arguments);
int priority_command(const Arguments& arguments);
int audit_command(const Arguments& arguments);
int pause_command(const Arguments& arguments);
int resume_command(const Arguments& arguments);
int cancel_command(const Arguments& arguments);
int retry_command(const Arguments& arguments);
int bench_command(const Arguments& arguments);

}  // namespace vantage
