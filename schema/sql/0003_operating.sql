-- What people order, and how the workers stand.

ALTER TABLE event ADD COLUMN who TEXT NOT NULL DEFAULT '';  -- who asked for it; '' = the farm itself
-- `vantage audit`: all but the moves of single jobs and attempts, which are thousands of times as many.
CREATE INDEX event_of_note ON event (id) WHERE kind NOT IN ('state', 'attempt');

CREATE TABLE stage_setting (   -- holds for all jobs of a kind in a shot, also those that are planned later;
  shot_id  INTEGER NOT NULL REFERENCES shot(id),  -- forgotten with the next submission
  kind     TEXT NOT NULL,
  paused   INTEGER NOT NULL DEFAULT 0,
  priority INTEGER,            -- NULL: the shot's
  PRIMARY KEY (shot_id, kind)
) WITHOUT ROWID;

CREATE TABLE suspect (         -- an artifact that a person wants made again although it is in the store
  shot_id  INTEGER NOT NULL REFERENCES shot(id),
  kind     TEXT NOT NULL,
  key      TEXT NOT NULL,
  content  TEXT NOT NULL,             -- what the next one is compared with
  aside    TEXT NOT NULL DEFAULT '',  -- the folder it was moved to when its job was claimed again; '' = still in place
  who      TEXT NOT NULL,
  asked_ms INTEGER NOT NULL,
  PRIMARY KEY (shot_id, kind, key)
) WITHOUT ROWID;

ALTER TABLE shot ADD COLUMN num_awaited INTEGER NOT NULL DEFAULT 0;  -- artifacts that the plan needs to grow further

ALTER TABLE worker ADD COLUMN tags      TEXT NOT NULL DEFAULT '';    -- words, one space between
ALTER TABLE worker ADD COLUMN kinds     TEXT NOT NULL DEFAULT '';    -- "depth/1 …" that it can run; '' = does not say
ALTER TABLE worker ADD COLUMN build     TEXT NOT NULL DEFAULT '';    -- version of its program
ALTER TABLE worker ADD COLUMN trouble   TEXT NOT NULL DEFAULT '';    -- why it takes no work now, in its own words
ALTER TABLE worker ADD COLUMN skew_ms   INTEGER NOT NULL DEFAULT 0;  -- its clock less ours
ALTER TABLE worker ADD COLUMN hours     TEXT NOT NULL DEFAULT '';    -- "mon-fri 19:00-07:00, sat-sun"; '' = always
ALTER TABLE worker ADD COLUMN set_aside TEXT NOT NULL DEFAULT '';    -- why it gets no work until it passes its self-test

CREATE TABLE worker_failure (  -- of jobs whose failing may be the worker's fault; forgotten after some hours
  worker_id TEXT NOT NULL REFERENCES worker(id),
  job_id    INTEGER NOT NULL REFERENCES job(id),
  kind      TEXT NOT NULL,
  at_ms     INTEGER NOT NULL,
  of_kind   INTEGER NOT NULL,  -- 1: no job of its kind has ended well there since
  in_row    INTEGER NOT NULL,  -- 1: no job at all has
  PRIMARY KEY (worker_id, job_id)
) WITHOUT ROWID;

CREATE INDEX attempt_again ON attempt (job_id) WHERE number > 1;  -- how much had to be done again
