"""Names of blendshapes: ARKit's and those of other houses, and the movement that each stands for."""
