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
