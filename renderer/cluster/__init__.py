"""Passes on the workers of a Dask cluster: the same picture, bit for bit, whoever renders them.

A task is a few passes. Every worker process gets the checked scene once, builds it once, and renders each task by the
``Renderer.run`` that threads and ``--pass-range`` use, into a film that keeps its passes apart. They come back as
samples and are added here in the order of their numbers, as threads' passes are: sums of sums would round otherwise.
"""
