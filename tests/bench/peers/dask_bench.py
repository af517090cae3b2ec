#!/usr/bin/python3
"""No-op jobs through Dask distributed: one scheduler, two worker processes of one thread each, over local sockets.

    dask_bench.py NUM_JOBS

Prints one JSON line. Dask submits while it works, so there is only one time: from the first submission to the last end.
"""
import json
import sys
import time

import distributed
from distributed import Client, LocalCluster, wait


def noop(index):
    return index


def main():
    num_jobs = int(sys.argv[1])
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, Client(cluster) as client:
        wait(client.map(noop, range(100), pure=False))  # everything is imported and connected
        start = time.monotonic()
        futures = client.map(noop, range(num_jobs), pure=False)
        wait(futures)
        total_s = time.monotonic() - start
        assert all(future.status == "finished" for future in futures)
    print(json.dumps({"bench": "peer", "peer": f"Dask distributed {distributed.__version__}", "durable": False,
                      "process_per_job": False, "num_jobs": num_jobs, "slots": 2, "total_s": round(total_s, 3),
                      "ms_per_job": round(1000 * total_s / num_jobs, 4)}))


if __name__ == "__main__":
    main()
