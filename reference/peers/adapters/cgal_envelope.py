"""CGAL's edge collapse within a polyhedral envelope: cgal_envelope.py REQUEST

The user manual's example edge_collapse_envelope.cpp (Triangulated Surface Mesh Simplification), with the
error as the width of the envelope. The filter rejects a collapse if a new triangle leaves the envelope of the
input, which is within the error of the input (Polyhedral_envelope.h: "to be conservative"). Nothing bounds
the distance from the input to the output, and no topology is promised.
"""
import adapter


def work(request):
    command = [adapter.peer_program("cgal_peer"), "envelope", "IN.obj", "OUT.obj", request["error"]]
    return adapter.with_files(request, command, refusal="CGAL cannot take",
                              distance_to_input=request["error"])


adapter.run(work)
