-- The farm's state. One thread of the scheduler writes; everybody else reads through query-only connections.
-- Times: *_ms are wall-clock milliseconds since 1970 unless the name says monotonic.

CREATE TABLE meta (            -- farm_id, epoch; the schema's version is PRAGMA user_version
  key   TEXT PRIMARY KEY,
  value TEXT NOT NULL
) WITHOUT ROWID;

CREATE TABLE shot (
  id           INTEGER PRIMARY KEY,
  folder       TEXT NOT NULL UNIQUE,    -- absolute path
  name         TEXT NOT NULL,
  priority     INTEGER NOT NULL DEFAULT 0,
  state        TEXT NOT NULL,           -- running | done | failed | paused
  until_kind   TEXT NOT NULL DEFAULT '',-- stop after this stage; '' = all
  generation   INTEGER NOT NULL DEFAULT 0, -- rises with every submission; jobs of older ones are not wanted any more
  error        TEXT NOT NULL DEFAULT '',
  submitted_ms INTEGER NOT NULL,
  finished_ms  INTEGER
);

CREATE TABLE job (
  id            INTEGER PRIMARY KEY,
  shot_id       INTEGER NOT NULL REFERENCES shot(id),
  name          TEXT NOT NULL,          -- "<kind>/<what>"
  kind          TEXT NOT NULL,
  stage         INTEGER NOT NULL,       -- place of the kind in the pipeline: later stages go first
  version       INTEGER NOT NULL,
  generation    INTEGER NOT NULL,       -- the submission that wants it: equal to its shot's, or it is not in the plan
  plan_hash     TEXT NOT NULL,          -- hash of all that the plan says of it: tells a changed row from an unchanged one
  params        TEXT NOT NULL,          -- JSON
  unit          TEXT NOT NULL,          -- JSON
  sources       TEXT NOT NULL,          -- JSON [{name, path}]
  links         TEXT NOT NULL,          -- JSON [{from, to}]
  key           TEXT NOT NULL DEFAULT '',   -- known once all inputs are
  identity      TEXT NOT NULL DEFAULT '',   -- JSON that the key is the hash of: tells why the next key differs
  content       TEXT NOT NULL DEFAULT '',   -- content hash of the artifact once done
  state         TEXT NOT NULL,          -- blocked ready leased running done failed canceled aborted quarantined skipped
                                        -- reconnect paused; the table of moves is scheduler/store/job_state.h
  priority      INTEGER NOT NULL DEFAULT 0,
  num_unmet     INTEGER NOT NULL DEFAULT 0, -- needs that are not done or skipped yet
  cores         INTEGER NOT NULL,
  ram_mb        INTEGER NOT NULL,
  timeout_s     INTEGER NOT NULL,
  num_attempts  INTEGER NOT NULL DEFAULT 0,
  num_failures  INTEGER NOT NULL DEFAULT 0,
  num_crashes   INTEGER NOT NULL DEFAULT 0,
  not_before_ms INTEGER NOT NULL DEFAULT 0,
  reason        TEXT NOT NULL DEFAULT '',   -- why it runs, runs again, waits or was skipped: `vantage why`
  error_kind    TEXT NOT NULL DEFAULT '',
  error         TEXT NOT NULL DEFAULT '',
  phase         TEXT NOT NULL DEFAULT '',
  progress      REAL NOT NULL DEFAULT 0,
  wall_ms       INTEGER NOT NULL DEFAULT 0,
  peak_rss_mb   INTEGER NOT NULL DEFAULT 0,
  created_ms    INTEGER NOT NULL,
  finished_ms   INTEGER,
  UNIQUE (shot_id, name)
);
CREATE INDEX job_ready ON job (priority DESC, stage DESC, id) WHERE state = 'ready';
CREATE INDEX job_active ON job (state) WHERE state IN ('leased', 'running', 'reconnect');
CREATE INDEX job_by_kind ON job (shot_id, generation, kind, state);

CREATE TABLE dependency (
  job_id   INTEGER NOT NULL REFERENCES job(id),
  needs_id INTEGER NOT NULL REFERENCES job(id),
  PRIMARY KEY (job_id, needs_id)
) WITHOUT ROWID;
CREATE INDEX dependency_by_need ON dependency (needs_id);

CREATE TABLE worker (
  id           TEXT PRIMARY KEY,
  incarnation  INTEGER NOT NULL,
  host         TEXT NOT NULL,
  pool         TEXT NOT NULL DEFAULT '',
  slots        INTEGER NOT NULL,
  cores        INTEGER NOT NULL,
  ram_mb       INTEGER NOT NULL,
  free_disk_mb INTEGER NOT NULL DEFAULT 0,
  state        TEXT NOT NULL,           -- active | draining | lost
  last_seen_ms INTEGER NOT NULL
) WITHOUT ROWID;

CREATE TABLE attempt (
  id          INTEGER PRIMARY KEY,
  job_id      INTEGER NOT NULL REFERENCES job(id),
  number      INTEGER NOT NULL,
  token       INTEGER NOT NULL,
  worker_id   TEXT NOT NULL,
  key         TEXT NOT NULL,            -- of the result that it makes; the job's key may change meanwhile
  state       TEXT NOT NULL,            -- leased | running | ended
  outcome     TEXT NOT NULL DEFAULT '', -- done | failed | crashed | canceled | lost | stale
  error_kind  TEXT NOT NULL DEFAULT '',
  error       TEXT NOT NULL DEFAULT '',
  exit_code   INTEGER NOT NULL DEFAULT 0,
  signal      INTEGER NOT NULL DEFAULT 0,
  log_path    TEXT NOT NULL,
  leased_ms   INTEGER NOT NULL,
  started_ms  INTEGER,
  ended_ms    INTEGER,
  wall_ms     INTEGER NOT NULL DEFAULT 0,
  peak_rss_mb INTEGER NOT NULL DEFAULT 0,
  UNIQUE (job_id, number)
);
CREATE INDEX attempt_open ON attempt (worker_id) WHERE state <> 'ended';

CREATE TABLE event (                    -- what happened, in order: the audit trail
  id        INTEGER PRIMARY KEY,
  at_ms     INTEGER NOT NULL,
  shot_id   INTEGER,
  job_id    INTEGER,
  worker_id TEXT NOT NULL DEFAULT '',
  kind      TEXT NOT NULL,              -- submitted, state, attempt, worker, command, warning
  text      TEXT NOT NULL
);
CREATE INDEX event_by_job ON event (job_id, id);

CREATE TABLE source_hash (              -- content of footage, so that an unchanged file is not read again
  path     TEXT PRIMARY KEY,
  size     INTEGER NOT NULL,
  mtime_ns INTEGER NOT NULL,
  inode    INTEGER NOT NULL,
  hash     TEXT NOT NULL
) WITHOUT ROWID;
