//! Touching shared memory before it is needed.

use rustix::io::Errno;
use rustix::mm::{Advice, madvise};
use std::io;
use std::path::{Path, PathBuf};

/// Faults in all of this process's mappings of these files, so that no tick has to, and so that memory
/// which shared memory has no room for is an error now and not a fatal signal later.
pub(crate) fn populate(files: &[PathBuf]) -> io::Result<()> {
    let maps = std::fs::read_to_string("/proc/self/maps")?;
    for mapping in maps.lines().filter_map(Mapping::parse).filter(|mapping| mapping.is_of(files)) {
        let advice = if mapping.writable { Advice::LinuxPopulateWrite } else { Advice::LinuxPopulateRead };
        let address = core::ptr::without_provenance_mut(mapping.start);
        // SAFETY: the kernel has just named this mapping, and populating pages neither changes their
        // content nor where they are. Should another thread have unmapped it since, the kernel says so.
        match unsafe { madvise(address, mapping.end - mapping.start, advice) } {
            // Kernels before 5.14 don't know it: then the first ticks touch what they use.
            Ok(()) | Err(Errno::INVAL) => {}
            Err(errno) => return Err(errno.into()),
        }
    }
    Ok(())
}

/// A line of `/proc/self/maps`: `START-END PERMISSIONS OFFSET DEVICE INODE PATH`.
#[derive(Debug, PartialEq)]
struct Mapping<'a> {
    start: usize,
    end: usize,
    writable: bool,
    path: &'a Path,
}

impl<'a> Mapping<'a> {
    fn parse(line: &'a str) -> Option<Self> {
        let mut fields = line.split_ascii_whitespace();
        let (start, end) = fields.next()?.split_once('-')?;
        let permissions = fields.next()?;
        let path = fields.nth(3)?;
        permissions.starts_with('r').then_some(())?;
        Some(Self {
            start: usize::from_str_radix(start, 16).ok()?,
            end: usize::from_str_radix(end, 16).ok()?,
            writable: permissions.contains('w'),
            path: Path::new(path),
        })
    }

    fn is_of(&self, files: &[PathBuf]) -> bool {
        files.iter().any(|file| file == self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mappings_are_read_as_the_kernel_writes_them() {
        let line = "7f00-8f00 rw-s 00000000 00:19 12 /dev/shm/some_file";
        let expected =
            Mapping { start: 0x7f00, end: 0x8f00, writable: true, path: Path::new("/dev/shm/some_file") };
        assert_eq!(Mapping::parse(line), Some(expected));
        assert_eq!(Mapping::parse("7f00-8f00 ---p 00000000 00:19 12 /dev/shm/some_file"), None);
        assert_eq!(Mapping::parse("7f00-8f00 rw-p 00000000 00:00 0 "), None);
    }

    #[test]
    fn populating_allocates_what_was_only_promised() {
        use std::os::unix::fs::MetadataExt;
        let directory = tempfile::tempdir_in("/dev/shm").expect("shared memory");
        let path = directory.path().join("sparse");
        let file = std::fs::File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path)
            .expect("it can be made");
        file.set_len(1 << 20).expect("it can grow");
        let _map = memmap2::MmapRaw::map_raw(&file).expect("it can be mapped");
        let allocated = || file.metadata().expect("it is there").blocks() * 512;
        assert_eq!(allocated(), 0);
        populate(&[path]).expect("there is a megabyte");
        assert_eq!(allocated(), 1 << 20);
    }
}
