#pragma once
#include "schema/base/json.h"
#include "schema/formats/camera.h"

namespace vantage {

Json to_json(const Pinhole& pinhole);
Pinhole pinhole_from(const Json& json);
/// R row by row, then t.
Json to_json(const RigidTransform& pose);
RigidTransform pose_from(const Json& json);

}  // namespace vantage
