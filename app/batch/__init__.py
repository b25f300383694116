"""Recipes on many meshes and in many variants, on one machine or a Dask cluster."""
