-- Frames have a third file: what was counted, tile by tile. A check cannot be changed in place, so the table is made anew.
CREATE TABLE files_of_three_kinds (
    job      BLOB    NOT NULL REFERENCES jobs (id),
    position INTEGER NOT NULL,
    kind     TEXT    NOT NULL CHECK (kind IN ('exr', 'png', 'json')),
    blob     BLOB    NOT NULL CHECK (length(blob) = 32),
    size     INTEGER NOT NULL,
    PRIMARY KEY (job, position, kind)
) STRICT, WITHOUT ROWID;
INSERT INTO files_of_three_kinds SELECT job, position, kind, blob, size FROM files;
DROP TABLE files;
ALTER TABLE files_of_three_kinds RENAME TO files;
