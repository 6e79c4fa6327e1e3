// Includes all public headers except hermesh/openvdb.h, which needs OpenVDB, and hermesh/validate.h, whose
// library is under the GPL.
#pragma once

#include "hermesh/context.h"
#include "hermesh/error.h"
#include "hermesh/extract.h"
#include "hermesh/fracture.h"
#include "hermesh/hermite.h"
#include "hermesh/mesh.h"
#include "hermesh/options.h"
#include "hermesh/version.h"
#include "hermesh/volume.h"
#include "hermesh/voxelize.h"
