-- Small records about access: tokens by the hash of their secret, workers' certificates, the audit log. Keys are ordered by their bytes.
CREATE TABLE records (
    kind  TEXT COLLATE "C" NOT NULL,
    key   TEXT COLLATE "C" NOT NULL,
    value BYTEA            NOT NULL,
    PRIMARY KEY (kind, key)
);

-- What was written into the audit log stays as it is.
CREATE FUNCTION audit_is_only_appended_to() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    RAISE EXCEPTION 'the audit log is only appended to';
END $$;

CREATE TRIGGER audit_is_not_changed BEFORE UPDATE OR DELETE ON records
FOR EACH ROW WHEN (old.kind = 'audit') EXECUTE FUNCTION audit_is_only_appended_to();
