-- Runs of coordinators. A run counts its commits here, so that one whose answer was lost is not made twice; `heard` is its last sign of
-- life by the database's clock; once `ended` is set, the run can commit nothing more. `place` stays the same over restarts.
CREATE TABLE coordinators (
    session BYTEA       NOT NULL PRIMARY KEY CHECK (length(session) = 16),
    place   BYTEA       NOT NULL CHECK (length(place) = 16),
    http    TEXT        NOT NULL,
    grpc    TEXT        NOT NULL,
    commits BIGINT      NOT NULL DEFAULT 0,
    heard   TIMESTAMPTZ NOT NULL DEFAULT clock_timestamp(),
    ended   TIMESTAMPTZ
) WITH (fillfactor = 50);

-- The run that owns a job. Without one, or when it has ended, the next one that looks takes it.
ALTER TABLE jobs ADD COLUMN owner BYTEA CHECK (length(owner) = 16);
CREATE INDEX jobs_by_owner ON jobs (owner);
