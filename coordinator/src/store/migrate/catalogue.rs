//! What tables a database has: names, columns and who refers to whom, by its own account.

use super::Side;
use crate::store::StoreError;
use crate::store::sql::{Kind, Row, Statement, Value};

/// Tables that belong to their database alone.
const OWN_TABLES: [&str; 2] = ["coordinators", "_sqlx_migrations"];
/// Columns that do.
const OWN_COLUMNS: [(&str, &str); 1] = [("jobs", "owner")];

/// A table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Table {
    pub(super) name: String,
    /// In the order of their names.
    pub(super) columns: Vec<Column>,
    /// Tables that its rows refer to.
    refers: Vec<String>,
}

/// A column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) name: String,
    kind: Kind,
}

impl Table {
    /// Reads all rows.
    pub(super) fn select(&self) -> String {
        format!("SELECT {} FROM \"{}\"", self.names(), self.name)
    }

    /// Writes so many rows.
    pub(super) fn insert(&self, rows: usize) -> String {
        let width = self.columns.len();
        let row = |row: usize| {
            let places: Vec<String> = (1..=width).map(|column| format!("${}", row * width + column)).collect();
            format!("({})", places.join(", "))
        };
        let rows: Vec<String> = (0..rows).map(row).collect();
        format!("INSERT INTO \"{}\" ({}) VALUES {}", self.name, self.names(), rows.join(", "))
    }

    /// What a row holds, column by column.
    pub(super) fn values(&self, row: &Row) -> Result<Vec<Value>, StoreError> {
        self.columns.iter().enumerate().map(|(at, column)| row.value(at, column.kind)).collect()
    }

    fn names(&self) -> String {
        let names: Vec<String> = self.columns.iter().map(|column| format!("\"{}\"", column.name)).collect();
        names.join(", ")
    }
}

/// All tables that are not the database's own, each after those that it refers to.
pub(super) async fn tables(side: &mut Side) -> Result<Vec<Table>, StoreError> {
    let [names, columns, refers] = match side {
        Side::Sqlite { .. } => [
            "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite!_%' ESCAPE '!' ORDER BY name",
            "SELECT name, type AS kind FROM pragma_table_info($1) ORDER BY name",
            "SELECT DISTINCT \"table\" AS name FROM pragma_foreign_key_list($1)",
        ],
        Side::Postgres(_) => [
            "SELECT table_name::text AS name FROM information_schema.tables
             WHERE table_schema = current_schema() AND table_type = 'BASE TABLE' ORDER BY 1",
            "SELECT column_name::text AS name, data_type::text AS kind FROM information_schema.columns
             WHERE table_schema = current_schema() AND table_name = $1 ORDER BY 1",
            "SELECT DISTINCT target.relname::text AS name FROM pg_constraint
             JOIN pg_class AS source ON source.oid = conrelid JOIN pg_class AS target ON target.oid = confrelid
             WHERE contype = 'f' AND source.relname = $1 AND source.relnamespace = current_schema()::text::regnamespace",
        ],
    };
    let names = texts(side, Statement::new(names)).await?;
    let mut left = Vec::new();
    for name in names.into_iter().filter(|name| !OWN_TABLES.contains(&name.as_str())) {
        let refers = texts(side, Statement::new(refers).text(&name)).await?;
        let mut found = Vec::new();
        let each = |row: Row| {
            found.push((row.text("name")?, row.text("kind")?));
            Ok(())
        };
        side.on().each(Statement::new(columns).text(&name), each).await?;
        found.retain(|(column, _)| !OWN_COLUMNS.contains(&(name.as_str(), column.as_str())));
        found.sort();
        let column = |(column, kind): (String, String)| match Kind::of(&kind) {
            Some(kind) => Ok(Column { name: column, kind }),
            None => Err(StoreError::Corrupt { row: format!("{name}.{column}"), found: format!("values of type {kind}") }),
        };
        let columns = found.into_iter().map(column).collect::<Result<_, _>>()?;
        left.push(Table { refers: refers.into_iter().filter(|other| *other != name).collect(), name, columns });
    }
    let mut sorted: Vec<Table> = Vec::new();
    while !left.is_empty() {
        let ready = |table: &Table| table.refers.iter().all(|other| sorted.iter().any(|before| before.name == *other));
        let Some(next) = left.iter().position(ready) else {
            return Err(StoreError::Corrupt { row: "catalogue".into(), found: "tables that refer to each other in a circle".into() });
        };
        sorted.push(left.remove(next));
    }
    Ok(sorted)
}

async fn texts(side: &mut Side, statement: Statement) -> Result<Vec<String>, StoreError> {
    let mut found = Vec::new();
    let each = |row: Row| {
        found.push(row.text("name")?);
        Ok(())
    };
    side.on().each(statement, each).await?;
    Ok(found)
}
