//! Records, in either database. Each change is one statement, hence a transaction of its own.

use super::{Connection, Statement};
use crate::store::StoreError;

/// A record.
pub(in crate::store) async fn one(connection: &mut Connection<'_>, kind: &str, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
    let select = Statement::new("SELECT value FROM records WHERE kind = $1 AND key = $2").text(kind).text(key);
    connection.first(select).await?.map(|row| row.bytes("value")).transpose()
}

/// Records of a kind, the largest key first.
pub(in crate::store) async fn many(
    connection: &mut Connection<'_>,
    kind: &str,
    before: Option<&str>,
    most: u32,
) -> Result<Vec<(String, Vec<u8>)>, StoreError> {
    let select = Statement::new("SELECT key, value FROM records WHERE kind = $1 AND key < $2 ORDER BY key DESC LIMIT $3");
    // No key reaches the last of all characters.
    let select = select.text(kind).text(before.unwrap_or("\u{10ffff}")).integer(most);
    let mut found = Vec::new();
    let take = |row: super::Row| {
        found.push((row.text("key")?, row.bytes("value")?));
        Ok(())
    };
    connection.each(select, take).await?;
    Ok(found)
}

/// Puts `new` in place of `old`; whether that was there.
pub(in crate::store) async fn replace(
    connection: &mut Connection<'_>,
    kind: &str,
    key: &str,
    old: Option<&[u8]>,
    new: Option<&[u8]>,
) -> Result<bool, StoreError> {
    let statement = match (old, new) {
        (None, None) => return Ok(one(connection, kind, key).await?.is_none()),
        (None, Some(new)) => {
            let insert = Statement::new("INSERT INTO records (kind, key, value) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING");
            insert.text(kind).text(key).bytes(new)
        }
        (Some(old), Some(new)) => {
            let update = Statement::new("UPDATE records SET value = $3 WHERE kind = $1 AND key = $2 AND value = $4");
            update.text(kind).text(key).bytes(new).bytes(old)
        }
        (Some(old), None) => {
            let delete = Statement::new("DELETE FROM records WHERE kind = $1 AND key = $2 AND value = $3");
            delete.text(kind).text(key).bytes(old)
        }
    };
    Ok(connection.execute(statement).await? == 1)
}
