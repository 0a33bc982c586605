-- Which reconstruction was chosen for a frame and why, where the plan leaves that to the film.
ALTER TABLE frames ADD COLUMN choice TEXT;
