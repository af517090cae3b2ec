#include "schema/formats/moving_areas.h"

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/binary.h"

namespace vantage {
namespace {

constexpr char kMagic[4] = {'V', 'M', 'O', 'V'};
constexpr std::uint32_t kVersion = 1;

void check_run(const BinaryReader& in, const MovingRun& run, const MovingAreas& areas) {
  if (run.begin >= run.end || run.end > areas.columns || run.row >= areas.rows)
    in.fail("has a run outside its grid of " + std::to_string(areas.columns) + " x " + std::to_string(areas.rows));
}

}  // namespace

void write_moving_areas(const std::filesystem::path& file, const MovingAreas& areas) {
  BinaryWriter out;
  out.put(kMagic);
  out.put(kVersion);
  out.put_size(areas.camera.size());
  out.put_bytes(areas.camera.data(), areas.camera.size());
  for (const int value : {areas.cell_px, areas.columns, areas.rows}) out.put(static_cast<std::int32_t>(value));
  out.put_size(areas.frames.size());
  for (const auto& runs : areas.frames) {
    out.put_size(runs.size());
    for (const MovingRun& run : runs) out.put(run.row), out.put(run.begin), out.put(run.end);
  }
  write_file_atomically(file, out.bytes());
}

MovingAreas read_moving_areas(const std::filesystem::path& track_artifact) {
  const auto file = track_artifact / "moving.bin";
  BinaryReader in(read_file(file), file.string());
  char magic[4];
  in.get_bytes(magic, sizeof magic);
  if (std::memcmp(magic, kMagic, sizeof magic) != 0)
    in.fail("is no file of moving areas, expected it to begin with VMOV");
  if (const auto version = in.get<std::uint32_t>(); version != kVersion)
    in.fail("has version " + std::to_string(version) + ", expected " + std::to_string(kVersion));
  MovingAreas areas;
  areas.camera.resize(in.get_size(1));
  in.get_bytes(areas.camera.data(), areas.camera.size());
  areas.cell_px = in.get<std::int32_t>();
  areas.columns = in.get<std::int32_t>();
  areas.rows = in.get<std::int32_t>();
  if (areas.cell_px < 1) in.fail("has cells of " + std::to_string(areas.cell_px) + " pixels, expected at least 1");
  areas.frames.resize(in.get_size(sizeof(std::uint32_t)));
  for (auto& runs : areas.frames) {
    runs.resize(in.get_size(3 * sizeof(std::uint16_t)));
    for (MovingRun& run : runs) {
      run.row = in.get<std::uint16_t>();
      run.begin = in.get<std::uint16_t>();
      run.end = in.get<std::uint16_t>();
      check_run(in, run, areas);
    }
  }
  if (!in.at_end()) in.fail("has bytes after its last frame");
  return areas;
}

}  // namespace vantage
