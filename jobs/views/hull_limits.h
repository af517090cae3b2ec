#pragma once
#include "jobs/views/virtual_view.h"

namespace vantage {

/// For outside = "refuse". Throws Error(BadInput) when a view, or one of its eyes, lies outside the recording hull:
/// which frame, where it is, how far the hull reaches.
void refuse_outside(const RenderRequest& request, const VirtualView& view, const Navspace& navspace);

}  // namespace vantage
