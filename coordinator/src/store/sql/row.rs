//! A row of either database, read column by column. What cannot be read is reported, never guessed.

use gradfarm_proto::Digest;
use sqlx::Row as _;
use sqlx::postgres::PgRow;
use sqlx::sqlite::SqliteRow;

use super::Value;
use crate::job::{JobId, Timestamp};
use crate::store::StoreError;

/// A row.
pub(in crate::store) enum Row {
    /// From a file.
    Sqlite(SqliteRow),
    /// From a server.
    Postgres(PgRow),
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) enum Kind {
    /// Whole numbers.
    Integer,
    /// Numbers.
    Real,
    /// Texts.
    Text,
    /// Bytes.
    Bytes,
}

impl Kind {
    /// The kind that a database calls by this name.
    pub(in crate::store) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "INTEGER" | "bigint" => Kind::Integer,
            "REAL" | "double precision" => Kind::Real,
            "TEXT" | "text" => Kind::Text,
            "BLOB" | "bytea" => Kind::Bytes,
            _ => return None,
        })
    }
}

/// A column's value, of a type that both databases know.
macro_rules! get {
    ($row:expr, $column:expr) => {
        match $row {
            Row::Sqlite(row) => row.try_get($column)?,
            Row::Postgres(row) => row.try_get($column)?,
        }
    };
}

impl Row {
    /// The value of a column of this kind, by its position.
    pub(in crate::store) fn value(&self, at: usize, kind: Kind) -> Result<Value, StoreError> {
        Ok(match kind {
            Kind::Integer => Value::Integer(get!(self, at)),
            Kind::Real => Value::Real(get!(self, at)),
            Kind::Text => Value::Text(get!(self, at)),
            Kind::Bytes => Value::Bytes(get!(self, at)),
        })
    }

    /// A whole number in the range of its type.
    pub(in crate::store) fn integer<T: TryFrom<i64>>(&self, column: &'static str) -> Result<T, StoreError> {
        let value: i64 = get!(self, column);
        in_range(value, column)
    }

    /// A whole number, if there is one.
    pub(in crate::store) fn integer_if<T: TryFrom<i64>>(&self, column: &'static str) -> Result<Option<T>, StoreError> {
        let value: Option<i64> = get!(self, column);
        value.map(|value| in_range(value, column)).transpose()
    }

    /// A number.
    pub(in crate::store) fn real(&self, column: &'static str) -> Result<f64, StoreError> {
        Ok(get!(self, column))
    }

    /// A number, if there is one.
    pub(in crate::store) fn real_if(&self, column: &'static str) -> Result<Option<f64>, StoreError> {
        Ok(get!(self, column))
    }

    /// A text.
    pub(in crate::store) fn text(&self, column: &'static str) -> Result<String, StoreError> {
        Ok(get!(self, column))
    }

    /// A text, if there is one.
    pub(in crate::store) fn text_if(&self, column: &'static str) -> Result<Option<String>, StoreError> {
        Ok(get!(self, column))
    }

    /// Bytes, if there are any.
    pub(in crate::store) fn bytes_if(&self, column: &'static str) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(get!(self, column))
    }

    /// Bytes.
    pub(in crate::store) fn bytes(&self, column: &'static str) -> Result<Vec<u8>, StoreError> {
        Ok(get!(self, column))
    }

    /// So many bytes.
    pub(in crate::store) fn array<const N: usize>(&self, column: &'static str) -> Result<[u8; N], StoreError> {
        let value = self.bytes(column)?;
        let length = value.len();
        value.try_into().map_err(|_| StoreError::Corrupt { row: column.into(), found: format!("{length} bytes instead of {N}") })
    }

    /// The name of a job.
    pub(in crate::store) fn job(&self, column: &'static str) -> Result<JobId, StoreError> {
        self.array(column).map(JobId::from_bytes)
    }

    /// The name of a content.
    pub(in crate::store) fn digest(&self, column: &'static str) -> Result<Digest, StoreError> {
        self.array(column).map(Digest::from)
    }

    /// A time, if there is one.
    pub(in crate::store) fn time_if(&self, column: &'static str) -> Result<Option<Timestamp>, StoreError> {
        Ok(self.integer_if(column)?.map(Timestamp::from_millis))
    }
}

fn in_range<T: TryFrom<i64>>(value: i64, column: &'static str) -> Result<T, StoreError> {
    T::try_from(value).map_err(|_| StoreError::Corrupt { row: column.into(), found: value.to_string() })
}
