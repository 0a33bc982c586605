-- What a job asks of the farm (JSON; NULL: nothing).
ALTER TABLE jobs ADD COLUMN needs TEXT;

-- A frame may be made without some of its units, with units of a worker that was found to give wrong results, or not at all (`failure` says
-- why; its state is then `assembling`, for that is where it stopped).
ALTER TABLE frames ADD COLUMN failed_units BIGINT NOT NULL DEFAULT 0;
ALTER TABLE frames ADD COLUMN suspect_units BIGINT NOT NULL DEFAULT 0;
ALTER TABLE frames ADD COLUMN failure TEXT;

-- A unit that failed too often is given up until somebody wants it tried again.
ALTER TABLE units ADD COLUMN given_up BIGINT NOT NULL DEFAULT 0 CHECK (given_up IN (0, 1));

-- Who made a result (NULL: made by an older version). A result is taken back only if its worker is found to give wrong ones.
ALTER TABLE results ADD COLUMN worker BYTEA CHECK (length(worker) = 16);

-- Attempts at units that came to nothing, in order.
CREATE TABLE attempts (
    job    BYTEA   NOT NULL REFERENCES jobs (id),
    unit   BIGINT NOT NULL,
    number BIGINT NOT NULL,
    worker BYTEA   NOT NULL CHECK (length(worker) = 16),
    epoch  BIGINT NOT NULL,
    at     BIGINT NOT NULL,
    ending TEXT    NOT NULL CHECK (ending IN ('failed', 'lost', 'expired', 'stuck', 'differed')),
    reason TEXT    NOT NULL,
    PRIMARY KEY (job, unit, number)
);

-- What workers gave for units that are rendered twice and compared, until that is decided.
CREATE TABLE witnesses (
    job     BYTEA   NOT NULL REFERENCES jobs (id),
    unit    BIGINT NOT NULL,
    epoch   BIGINT NOT NULL,
    worker  BYTEA   NOT NULL CHECK (length(worker) = 16),
    content BYTEA   NOT NULL CHECK (length(content) = 32),
    PRIMARY KEY (job, unit, epoch)
);
