"""The verbs over many campaigns and recordings: Dask computes, Parquet tables keep the results.

`sources` finds what there is to do, `work` does one campaign or recording in a worker, `dataset`
keeps the tables, `engine` hands tasks to Dask. `spread` and `siblings` look at the tires together.
Needs the extra ``tirelib[fleet]``.
"""
