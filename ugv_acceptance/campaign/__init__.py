"""Many recorded runs judged together: a statement of reliability (MTBF, success, trend).

In: folders, files or URLs of recordings, a robot's configuration, and a failure log that people
keep. Out: the statement as JSON (`report/` makes it a page), and the result of each run, stored
under a hash so that a campaign can be resumed. Runs are judged by processes of this machine or by
workers of a dask cluster. Read `carry_out.py` first, then `statement.py`.
"""
