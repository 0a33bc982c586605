//! Blobs in memory, in a folder and on an S3 server, with errors of each.

use object_store::aws::AmazonS3Builder;
use object_store::prefix::PrefixStore;

use super::*;
use crate::s3::Server;

/// Blobs on a server, below a prefix of their own.
fn on_s3(server: &Server, prefix: &str) -> Blobs {
    crate::crypto::provide();
    let builder = AmazonS3Builder::new()
        .with_bucket_name(Server::BUCKET)
        .with_endpoint(server.endpoint())
        .with_access_key_id(Server::KEY)
        .with_secret_access_key(Server::SECRET);
    Blobs::over(Arc::new(PrefixStore::new(uri::s3(builder).unwrap().build().unwrap(), prefix)), true)
}

#[tokio::test]
async fn content_is_kept_once_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start();
    for blobs in [Blobs::in_memory(), Blobs::in_folder(folder.path(), true).unwrap(), on_s3(&server, "a/b"), on_s3(&server, "")] {
        let content = Bytes::from_static(b"a tile");
        let digest = blobs.put(content.clone()).await.unwrap();
        assert_eq!(blobs.put(content.clone()).await.unwrap(), digest);
        assert_eq!(blobs.get(digest).await.unwrap(), content);
        assert!(blobs.has(digest).await.unwrap());
        let other = Digest::of(b"another tile");
        assert!(!blobs.has(other).await.unwrap());
        assert!(matches!(blobs.get(other).await, Err(BlobError::Missing(_))));
        assert!(blobs.all().await.unwrap().contains(&digest));
    }
}

#[tokio::test]
async fn damage_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let blobs = Blobs::in_folder(folder.path(), false).unwrap();
    let digest = blobs.put(Bytes::from_static(b"a tile")).await.unwrap();
    let text = digest.to_string();
    std::fs::write(folder.path().join(&text[..2]).join(&text[2..]), b"a bug!").unwrap();
    assert!(matches!(blobs.get(digest).await, Err(BlobError::Damaged(d, _)) if d == digest));
}

#[tokio::test]
async fn errors_of_an_s3_server_cost_nothing_but_time() {
    let server = Server::start();
    let blobs = on_s3(&server, "farm");
    // More in a row than the client below bears.
    for (k, faults) in [1, 2, 8].into_iter().enumerate() {
        server.fail(faults);
        let content = Bytes::from(vec![k as u8; 100_000]);
        let digest = blobs.put(content.clone()).await.unwrap();
        assert_eq!(server.faults_left(), 0);
        server.fail(faults);
        assert_eq!(blobs.get(digest).await.unwrap(), content);
        server.fail(faults);
        assert!(blobs.has(digest).await.unwrap());
        // The write that is done but whose answer is lost.
        server.lose_answers(1);
        assert_eq!(blobs.put(Bytes::from(vec![100 + k as u8; 1000])).await.unwrap(), Digest::of(&vec![100 + k as u8; 1000]));
        assert_eq!(server.faults_left(), 0);
    }
    assert_eq!(blobs.stock().await.unwrap().count, 6);
}

#[tokio::test]
async fn only_old_content_is_removed_and_what_is_asked_for_becomes_young() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start();
    for blobs in [Blobs::in_folder(folder.path(), false).unwrap(), on_s3(&server, "farm")] {
        let young = blobs.put(Bytes::from_static(b"young")).await.unwrap();
        assert_eq!(blobs.stock().await.unwrap(), aged::Stock { count: 1, bytes: 5, aged: vec![] });
        assert_eq!(blobs.remove(young).await.unwrap(), None);
        assert!(blobs.has(young).await.unwrap());
        // With no grace at all everything is old.
        let strict = blobs.clone().with_grace(Duration::ZERO);
        while strict.stock().await.unwrap().aged.is_empty() {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        assert_eq!(strict.stock().await.unwrap().aged, [young]);
        assert_eq!(strict.remove(young).await.unwrap(), Some(5));
        assert_eq!(strict.remove(young).await.unwrap(), None);
        assert!(!blobs.has(young).await.unwrap());
        // Content that is written again while it is being removed is there in the end, every time.
        for _ in 0..if strict.remote { 1 } else { 9 } {
            let (put, _) = tokio::join!(strict.put(Bytes::from_static(b"young")), strict.remove(young));
            put.unwrap();
            strict.put(Bytes::from_static(b"young")).await.unwrap();
            assert!(strict.has(young).await.unwrap());
        }
    }
}

#[cfg(unix)]
#[tokio::test]
async fn content_in_a_folder_becomes_young_by_being_named_again() {
    let folder = tempfile::tempdir().unwrap();
    let blobs = Blobs::in_folder(folder.path(), false).unwrap();
    let digest = blobs.put(Bytes::from_static(b"a tile")).await.unwrap();
    let text = digest.to_string();
    let file = folder.path().join(&text[..2]).join(&text[2..]);
    let grow_old = || {
        let long_ago = std::time::SystemTime::now() - 3 * GRACE;
        std::fs::File::options().write(true).open(&file).unwrap().set_modified(long_ago).unwrap();
    };
    grow_old();
    assert_eq!(blobs.stock().await.unwrap().aged, [digest]);
    assert!(blobs.has(digest).await.unwrap());
    assert_eq!(blobs.stock().await.unwrap().aged, []);
    grow_old();
    blobs.put(Bytes::from_static(b"a tile")).await.unwrap();
    assert_eq!(blobs.remove(digest).await.unwrap(), None);
    grow_old();
    assert_eq!(blobs.remove(digest).await.unwrap(), Some(6));
}
