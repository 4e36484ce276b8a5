"""Reads recordings into columns of numbers, salvages damaged files, and writes recordings.

In: rosbag2 folders, MCAP, SQLite or ROS 1 files, also damaged ones; or one serialised message at a
time. Out: batches of columns (evaluation/samples.py) in order of log time, single samples, and
sentences about what is wrong with the files; the writers make MCAP files and rosbag2 folders. No
verdicts here, and no ROS installation is needed. Read recording.py first (the Python front door),
then reader.py (`open_bag`) and reading.py (batches); cdr.py decodes one message, columns.py many,
mcap_index.py and salvage.py find the chunks of an MCAP file, writer.py records.
"""
