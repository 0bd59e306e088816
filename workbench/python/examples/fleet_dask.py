"""The same fleet on Dask: `python fleet_dask.py manifest.csv results`. Needs `pip install "dask[distributed]"`."""

import sys
from pathlib import Path

from distributed import Client, LocalCluster
from truing.fleet import judge, tasks

if __name__ == "__main__":
    manifest, into = sys.argv[1], Path(sys.argv[2]).resolve()
    # One core a worker, as many as there are cores; it listens on this machine only.
    with LocalCluster(host="127.0.0.1", threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        jobs = client.map(lambda rows: judge(rows, into), tasks(manifest), retries=100, pure=False)
        for sentence in sum(client.gather(jobs), []):
            print(sentence)
