-- Small records about access: tokens by the hash of their secret, workers' certificates, the audit log.
CREATE TABLE records (
    kind  TEXT NOT NULL,
    key   TEXT NOT NULL,
    value BLOB NOT NULL,
    PRIMARY KEY (kind, key)
) STRICT, WITHOUT ROWID;

-- What was written into the audit log stays as it is.
CREATE TRIGGER audit_is_not_changed BEFORE UPDATE ON records WHEN old.kind = 'audit'
BEGIN SELECT RAISE(ABORT, 'the audit log is only appended to'); END;

CREATE TRIGGER audit_is_not_shortened BEFORE DELETE ON records WHEN old.kind = 'audit'
BEGIN SELECT RAISE(ABORT, 'the audit log is only appended to'); END;
