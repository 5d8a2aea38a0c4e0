:- module(planner_greedy,
          [ greedy/3,                   % +Jobs, +Needed, -Runs
            improved/4,                 % +Jobs, +Until, +Runs, -Runs
            length_of/3                 % +Crew, +Legs, -End
          ]).

/** <module> A first plan for jobs that robots do on their own, and a better one by exchanging jobs

The jobs are given away one by one, the hardest (that takes longest even for who does it fastest) first,
each where the robot is done earliest. Then the busiest robot gets rid of a job: another one takes it
over, passing one of its own on if need be (an ejection chain of two). Runs are lists of legs, one for
each crew in their order.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(planner_golog(legs)).

%   r(I, Crew, Options, Legs, End): the Ith robot does these legs until then; Options holds, by job, what it can do.

%!  greedy(+Jobs, +Needed, -Runs) is semidet.
%
%   Needed: the jobs that need a robot. Fails where it finds nothing; there may be a plan all the same.

greedy(jobs(N, Crews, Team, _, _), Needed, Runs) :-
    empty_runs(N, Crews, Robots0),
    maplist(hardness(Robots0), Needed, Hardness),
    pairs_keys_values(Pairs, Hardness, Needed),
    sort(1, @>=, Pairs, Sorted),
    pairs_values(Sorted, Order),
    foldl(give(Team), Order, Robots0, Robots),
    maplist(legs, Robots, Runs).

legs(r(_, _, _, Legs, _), Legs).

with_legs(r(I, Crew, Options, _, _), Legs, r(I, Crew, Options, Legs, End)) :-
    length_of(Crew, Legs, End).

empty_runs(N, Crews, Robots) :-
    findall(Job, between(1, N, Job), Jobs),
    foldl(empty_run(Jobs), Crews, Robots, 1, _).

empty_run(Jobs, Crew, r(I, Crew, Options, [], Ms), I, I1) :-
    I1 is I + 1,
    Crew = crew(_, _, _, Ms, _, _, Legs),
    options(Jobs, Legs, Lists),
    compound_name_arguments(Options, options, Lists).

options([], _, []).
options([Job|Jobs], Legs, [Mine|Lists]) :-
    of_job(Legs, Job, Mine, Rest),
    options(Jobs, Rest, Lists).

of_job([Leg|Legs], Job, [Leg|Mine], Rest) :-
    leg_job(Leg, Job), !,
    of_job(Legs, Job, Mine, Rest).
of_job(Legs, _, [], Legs).

hardness(Robots, Job, Hardness) :-
    never(Never),
    foldl(sooner(Job), Robots, Never, Hardness),
    Hardness < Never.

sooner(Job, Robot, Ms0, Ms) :-
    ( inserted(Job, Robot, Ms0, r(_, _, _, _, Ms)) -> true ; Ms = Ms0 ).

give(Team, Job, Robots0, Robots) :-
    never(Never),
    members(Robots0, Team, Who),
    best(Who, Job, Never, none, Robot),
    Robot \== none,
    replaced(Robot, Robots0, Robots).

%   Who may do something: if the team is complete, those who are in it.
members(Robots, Team, Who) :-
    partition(in_team, Robots, In, Out),
    length(In, Size),
    ( Size < Team -> append(In, Out, Who) ; Who = In ).

in_team(r(_, crew(_, Begun, _, _, _, _, _), _, Legs, _)) :-
    ( Begun == true -> true ; Legs \== [] ).

best([], _, _, Robot, Robot).
best([Robot0|Robots], Job, Until, Best0, Best) :-
    (   inserted(Job, Robot0, Until, Robot)
    ->  Robot = r(_, _, _, _, Until1),
        best(Robots, Job, Until1, Robot, Best)
    ;   best(Robots, Job, Until, Best0, Best)
    ).

replaced(Robot, [Robot0|Robots0], [Robot1|Robots]) :-
    Robot = r(I, _, _, _, _),
    (   Robot0 = r(I, _, _, _, _)
    ->  Robot1 = Robot, Robots = Robots0
    ;   Robot1 = Robot0,
        replaced(Robot, Robots0, Robots)
    ).

%!  inserted(+Job, +Robot, +Until, -Robot) is semidet.
%
%   The job is put where the run gets longest least; it ends before Until.

inserted(Job, r(I, Crew, Options, Legs, _), Until, r(I, Crew, Options, Best, End)) :-
    arg(Job, Options, Ways),
    Ways \== [],
    Crew = crew(_, _, At, Ms, Work, Tables, _),
    Lasts is Until,
    places(Ways, Legs, At, Ms, Tables, none, Lasts, Place, End),
    Place \== none,
    Place = Before-Leg,
    length(Prefix, Before),
    append(Prefix, Rest, Legs),
    append(Prefix, [Leg|Rest], Best),
    ( Work == none -> true ; length_of(Crew, Best, _) ).

places([], _, _, _, _, Place, End, Place, End).
places([Leg|Ways], Legs, At, Ms, Tables, Place0, End0, Place, End) :-
    positions(Legs, 0, Leg, At, Ms, Tables, Place0, End0, Place1, End1),
    places(Ways, Legs, At, Ms, Tables, Place1, End1, Place, End).

positions(Legs, Before, Leg, At, Ms, Tables, Place0, End0, Place, End) :-
    row(Tables, At, Row),
    (   leg_cost(Leg, Row, Cost),
        Next is Ms + Cost,
        Next < End0,
        leg_end(Leg, At, At1),
        ends(Legs, At1, Next, Tables, End1),
        End1 < End0
    ->  Place1 = Before-Leg
    ;   Place1 = Place0, End1 = End0
    ),
    (   Legs = [First|Rest],
        leg_cost(First, Row, Step)
    ->  leg_end(First, At, Then),
        Later is Ms + Step,
        Before1 is Before + 1,
        positions(Rest, Before1, Leg, Then, Later, Tables, Place1, End1, Place, End)
    ;   Place = Place1, End = End1
    ).

ends([], _, End, _, End).
ends([Leg|Legs], At, Ms, Tables, End) :-
    row(Tables, At, Row),
    leg_cost(Leg, Row, Cost),
    Next is Ms + Cost,
    leg_end(Leg, At, At1),
    ends(Legs, At1, Next, Tables, End).

%!  length_of(+Crew, +Legs, -End) is semidet.
%
%   When the run ends; fails if it cannot be done, or the robot cannot work for so long.

length_of(crew(_, _, At, Ms, Work, Tables, _), Legs, End) :-
    ends(Legs, At, Ms, Tables, End),
    (   Work == none
    ->  true
    ;   maplist(leg_spare, Legs, Spares),
        sum_list(Spares, Spare),
        End - Ms - Spare =< Work
    ).

%!  improved(+Jobs, +Until, +Runs, -Runs) is det.
%
%   No run of the result is longer than the longest before. Stops at Until: it need not get shorter.

improved(jobs(N, Crews, Team, _, _), Until, Runs0, Runs) :-
    empty_runs(N, Crews, Empty),
    maplist(with_legs, Empty, Runs0, Robots0),
    shorten(Team, Until, Robots0, Robots),
    maplist(legs, Robots, Runs).

shorten(Team, Until, Robots0, Robots) :-
    foldl(busier, Robots0, r(0, none, none, [], -1), Busiest),
    Busiest = r(_, _, _, _, Makespan),
    (   Makespan > Until,
        relieved(Busiest, Team, Robots0, Robots1)
    ->  shorten(Team, Until, Robots1, Robots)
    ;   Robots = Robots0
    ).

busier(Robot, Robot0, Busier) :-
    Robot = r(_, _, _, _, End),
    Robot0 = r(_, _, _, _, End0),
    ( End > End0 -> Busier = Robot ; Busier = Robot0 ).

%   The busiest gives a job to another one, who does it before the makespan; or who passes one of its own on.
relieved(r(I, Crew, Options, Legs, Makespan), Team, Robots0, Robots) :-
    (   handed_on(I, Crew, Options, Legs, Makespan, Job, Robots0, Robots1),
        members(Robots1, Team, Who),
        member(Robot0, Who),
        Robot0 = r(J, _, _, _, _), J =\= I,
        inserted(Job, Robot0, Makespan, Robot),
        replaced(Robot, Robots1, Robots)
    ->  true
    ;   handed_on(I, Crew, Options, Legs, Makespan, Job, Robots0, Robots1),
        members(Robots1, Team, Who),
        member(r(J, Crew1, Options1, Legs1, _), Who), J =\= I,
        arg(Job, Options1, [_|_]),
        select(Leg2, Legs1, Rest1),
        leg_job(Leg2, Job2),
        length_of(Crew1, Rest1, End1),
        inserted(Job, r(J, Crew1, Options1, Rest1, End1), Makespan, Robot1),
        replaced(Robot1, Robots1, Robots2),
        member(Robot3, Who),
        Robot3 = r(K, _, _, _, _), K =\= J,
        inserted(Job2, Robot3, Makespan, Robot4)
    ->  replaced(Robot4, Robots2, Robots)
    ;   fail
    ).

handed_on(I, Crew, Options, Legs, Makespan, Job, Robots0, Robots) :-
    select(Leg, Legs, Rest),
    leg_job(Leg, Job),
    length_of(Crew, Rest, End),
    End < Makespan,
    replaced(r(I, Crew, Options, Rest, End), Robots0, Robots).
