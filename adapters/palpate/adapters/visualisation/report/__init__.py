"""One page about a run or a study: its pictures, its tables, and what they were made of; see :func:`.build.page_of`."""
