// Marks what the libraries show, and the namespace that public names live in.
#pragma once

#if defined(_WIN32)
#define HERMESH_API
#else
/// What of a shared library other programs see; all else is hidden.
#define HERMESH_API __attribute__((visibility("default")))
#endif

// Other programs say hermesh::Mesh, which is hermesh::v1::Mesh. A later version with other members can live
// in v2 beside it, so that programs compiled against either find their own. Only hermesh's own sources, whose
// names live in namespace hermesh itself, have to say v1.
#ifdef HERMESH_IMPLEMENTATION
#define HERMESH_V1 v1
#else
/// The version of the public names.
#define HERMESH_V1 inline v1
#endif
