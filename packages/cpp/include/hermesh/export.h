// Marks exported names, and defines the namespace of the public names.
#pragma once

#if defined(_WIN32)
#define HERMESH_API
#else
/// Exports a name from the shared libraries; all others are hidden.
#define HERMESH_API __attribute__((visibility("default")))
#endif

// Other programs use hermesh::Mesh, which is hermesh::v1::Mesh. A later version with other members can exist
// next to it in v2. Only hermesh's own sources, whose names are in namespace hermesh itself, have to write
// v1.
#ifdef HERMESH_IMPLEMENTATION
#define HERMESH_V1 v1
#else
/// The version of the public names.
#define HERMESH_V1 inline v1
#endif
