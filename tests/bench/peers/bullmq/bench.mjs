// No-op jobs through BullMQ: the queue in a Redis that runs already, two worker processes of one job at a time.
//   bench.mjs PORT NUM_JOBS
// Prints one JSON line: submit_s, and run_s from the first claim to the last end.
import { fork } from "node:child_process";
import { createRequire } from "node:module";
import { Queue } from "bullmq";

const [port, numJobs] = process.argv.slice(2).map(Number);
const version = createRequire(import.meta.url)("bullmq/package.json").version;
const connection = { host: "127.0.0.1", port };
const queue = new Queue("bench", { connection });

const seconds = () => performance.now() / 1000;
const startWorker = () =>
  new Promise((resolve) => {
    const child = fork(new URL("./worker.mjs", import.meta.url), [String(port)]);
    child.once("message", () => resolve(child));
  });

await queue.waitUntilReady();
await queue.pause(); // workers connect first, and wait
const workers = await Promise.all([startWorker(), startWorker()]);

const submitStart = seconds();
const kBatch = 1000;
for (let first = 0; first < numJobs; first += kBatch) {
  const num = Math.min(kBatch, numJobs - first);
  await queue.addBulk(Array.from({ length: num }, (_, i) => ({ name: "noop", data: { index: first + i } })));
}
const submitted = seconds();
await queue.resume();
while ((await queue.getCompletedCount()) < numJobs) await new Promise((resolve) => setTimeout(resolve, 20));
const done = seconds();

for (const worker of workers) worker.disconnect();
await queue.close();
const round = (x) => Number(x.toFixed(4));
console.log(
  JSON.stringify({
    bench: "peer",
    peer: `BullMQ ${version} + Redis`,
    process_per_job: false,
    num_jobs: numJobs,
    slots: 2,
    submit_s: round(submitted - submitStart),
    run_s: round(done - submitted),
    total_s: round(done - submitStart),
    ms_per_job: round((1000 * (done - submitted)) / numJobs),
  }),
);
