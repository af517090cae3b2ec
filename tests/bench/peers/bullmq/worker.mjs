// One slot: a process that takes jobs that do nothing, one at a time. worker.mjs PORT
import { Worker } from "bullmq";

const worker = new Worker("bench", async () => {}, {
  connection: { host: "127.0.0.1", port: Number(process.argv[2]) },
  concurrency: 1,
});
worker.on("error", (error) => console.error(`worker: ${error.message}`));
await worker.waitUntilReady();
process.send("ready");
process.on("disconnect", () => process.exit(0));
