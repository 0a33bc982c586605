-- Runs of coordinators. A run counts its commits here, so that one whose answer was lost is not made twice; `heard` is its last sign of
-- life by the database's clock; once `ended` is set, the run can commit nothing more.
CREATE TABLE coordinators (
    session BYTEA       NOT NULL PRIMARY KEY CHECK (length(session) = 16),
    commits BIGINT      NOT NULL DEFAULT 0,
    heard   TIMESTAMPTZ NOT NULL DEFAULT clock_timestamp(),
    ended   TIMESTAMPTZ
) WITH (fillfactor = 50);
