-- Orders that came with an Idempotency-Key: what was answered, for those who ask again because they did not hear it.

CREATE TABLE kept_answer (
  who         TEXT NOT NULL,           -- each caller's keys are their own
  key         TEXT NOT NULL,
  fingerprint TEXT NOT NULL,           -- of the request: the same key with another one is a mistake
  answer      TEXT NOT NULL,           -- JSON
  at_ms       INTEGER NOT NULL,        -- forgotten after a day
  PRIMARY KEY (who, key)
) WITHOUT ROWID;
CREATE INDEX kept_answer_by_age ON kept_answer (at_ms);
