#include <string>
#include <vector>

#include "scheduler/cli/command_table.h"

int main(int argc, char** argv) { return vantage::run_command_line(std::vector<std::string>(argv + 1, argv + argc)); }
