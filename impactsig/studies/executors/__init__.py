"""Executors of a study's tiles: threads and processes here, a dask cluster, a GPU."""
