-- Frames may stop before they have all their samples. `goal` is how many samples per pixel they go to, as far as that is decided (NULL: those
-- of the plan), `stopped` why they go no further. What led to the decisions is kept with them: the error at so many samples.
ALTER TABLE frames ADD COLUMN goal INTEGER CHECK (goal > 0);
ALTER TABLE frames ADD COLUMN stopped TEXT CHECK (stopped IN ('error', 'seconds', 'samples'));

CREATE TABLE points (
    job           BLOB    NOT NULL,
    position      INTEGER NOT NULL,
    samples       INTEGER NOT NULL CHECK (samples > 0),
    cpu_seconds   REAL    NOT NULL,
    wall_seconds  REAL    NOT NULL,
    check_seconds REAL    NOT NULL,
    relmse        REAL    NOT NULL,
    low           REAL    NOT NULL,
    high          REAL    NOT NULL,
    PRIMARY KEY (job, position, samples),
    FOREIGN KEY (job, position) REFERENCES frames (job, position)
) STRICT, WITHOUT ROWID;
