-- Claims and counts that cost the same with a million jobs as with ten: nobody looks at jobs that cannot be claimed,
-- and nobody counts jobs.

ALTER TABLE job ADD COLUMN pool TEXT NOT NULL DEFAULT '';     -- only workers of this pool; '' = of any
ALTER TABLE job ADD COLUMN tags TEXT NOT NULL DEFAULT '';     -- words that its worker must all have, one space between
ALTER TABLE job ADD COLUMN class_id INTEGER NOT NULL DEFAULT 0;

CREATE TABLE need_class (        -- jobs that every worker can take equally well, or not at all
  id        INTEGER PRIMARY KEY,
  shot_id   INTEGER NOT NULL,
  kind      TEXT NOT NULL,
  pool      TEXT NOT NULL,
  tags      TEXT NOT NULL,
  cores     INTEGER NOT NULL,
  ram_mb    INTEGER NOT NULL,
  alone     INTEGER NOT NULL,             -- crashed before: nothing else may run beside them
  num_ready INTEGER NOT NULL DEFAULT 0,   -- jobs that can be claimed now: rows of the index job_ready
  UNIQUE (shot_id, kind, pool, tags, cores, ram_mb, alone)
);
CREATE INDEX need_class_ready ON need_class (id) WHERE num_ready > 0;

CREATE TABLE job_count (         -- jobs of each shot's present generation; rows with 0 may stand
  shot_id INTEGER NOT NULL,
  kind    TEXT NOT NULL,
  state   TEXT NOT NULL,
  num     INTEGER NOT NULL,
  wall_ms INTEGER NOT NULL,               -- of those jobs together
  PRIMARY KEY (shot_id, kind, state)
) WITHOUT ROWID;

DROP INDEX job_ready;
DROP INDEX job_active;           -- the open attempts say the same
CREATE INDEX job_ready ON job (class_id, priority DESC, stage DESC, id) WHERE state = 'ready' AND not_before_ms = 0;
CREATE INDEX job_waiting ON job (not_before_ms) WHERE state = 'ready' AND not_before_ms > 0;

INSERT INTO need_class (shot_id, kind, pool, tags, cores, ram_mb, alone)
  SELECT DISTINCT shot_id, kind, '', '', cores, ram_mb, num_crashes > 0 FROM job;
UPDATE job SET class_id = (
  SELECT c.id FROM need_class c WHERE c.shot_id = job.shot_id AND c.kind = job.kind AND c.pool = '' AND c.tags = ''
    AND c.cores = job.cores AND c.ram_mb = job.ram_mb AND c.alone = (job.num_crashes > 0));
UPDATE need_class SET num_ready = (
  SELECT count(*) FROM job WHERE class_id = need_class.id AND state = 'ready' AND not_before_ms = 0);
INSERT INTO job_count (shot_id, kind, state, num, wall_ms)
  SELECT shot_id, kind, job.state, count(*), sum(wall_ms) FROM job JOIN shot ON shot.id = shot_id
  WHERE job.generation = shot.generation GROUP BY shot_id, kind, job.state;
