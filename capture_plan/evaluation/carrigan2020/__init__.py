"""Carrigan et al. 2020, Expression packing: what the paper measures, on your own rig."""
