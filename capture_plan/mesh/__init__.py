"""Geometry that the other rooms share, as functions of (vertices, triangles)."""

from capture_plan.mesh.geodesic import geodesic_distance, near_table, straight_table, surface_graph
from capture_plan.mesh.geometry import (
    border_edges,
    boundary_vertices,
    counted_edges,
    edges,
    half_edges,
    piece_areas,
    pieces,
    triangle_areas,
    vertex_areas,
    vertex_normals,
)
from capture_plan.mesh.laplacian import cotangent_laplacian, cotangents, mixed_areas, with_area
from capture_plan.mesh.procrustes import rigid_fit, similarity_fit

__all__ = [
    "border_edges",
    "boundary_vertices",
    "cotangent_laplacian",
    "cotangents",
    "counted_edges",
    "edges",
    "geodesic_distance",
    "half_edges",
    "mixed_areas",
    "near_table",
    "piece_areas",
    "pieces",
    "rigid_fit",
    "similarity_fit",
    "straight_table",
    "surface_graph",
    "triangle_areas",
    "vertex_areas",
    "vertex_normals",
    "with_area",
]
