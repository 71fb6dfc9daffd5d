"""Whether a plan says the truth: every claim recomputed from the rig, by code that knows no solver."""
