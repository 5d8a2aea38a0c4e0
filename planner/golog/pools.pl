:- module(planner_pools,
          [ jobs_mask/2,                % +Jobs, -Mask
            pool_robot/6,               % +I, +Begun, +Monotone, +Needed, +Masks, -Robot
            cover/5                     % +Jobs, +Pool, +Seats, +State, -Chosen
          ]).

/** <module> Who does which job, when each robot has a choice of runs

Depth first: the job that fewest robots can do is given to one of them, or it is not. What only one can
do, it does. Prices (planner_prices) refute what cannot work out, and strike off runs that cannot be part
of a solution; they point at the robot to try first.

A pool is a list of p(I, Used, Must, Monotone, Sets), see planner_prices: the Ith robot does the jobs Must
already, and one of Sets besides. If Monotone is true, a run without one of its jobs is a run, so a robot
need not do all of the set.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(aggregate)).
:- use_module(planner_golog(prices)).

:- set_prolog_flag(optimise, true).

%!  jobs_mask(+Jobs, -Mask) is det.

jobs_mask(Jobs, Mask) :- jobs_mask(Jobs, 0, Mask).

jobs_mask([], Mask, Mask).
jobs_mask([Job|Jobs], Mask0, Mask) :-
    Mask1 is Mask0 \/ (1 << Job),
    jobs_mask(Jobs, Mask1, Mask).

mask_jobs(0, []) :- !.
mask_jobs(Mask, [Job|Jobs]) :-
    Job is lsb(Mask),
    Rest is Mask /\ (Mask - 1),
    mask_jobs(Rest, Jobs).

%!  pool_robot(+I, +Begun, +Monotone, +Needed, +Masks, -Robot) is det.
%
%   Its runs, as far as they are about jobs that are needed; one that takes part anyhow may do nothing more.

pool_robot(I, Begun, Monotone, Needed, Masks0, p(I, Begun, 0, Monotone, Sets)) :-
    needed(Masks0, Monotone, Needed, Masks1),
    ( Begun == true -> Masks2 = [0|Masks1] ; Masks2 = Masks1 ),
    sort(Masks2, Masks),
    maplist(set, Masks, Sets).

needed([], _, _, []).
needed([Mask0|Masks0], Monotone, Needed, Masks) :-
    Mask is Mask0 /\ Needed,
    ( ( Monotone == true ; Mask =:= Mask0 ) -> Masks = [Mask|Masks1] ; Masks = Masks1 ),
    needed(Masks0, Monotone, Needed, Masks1).

set(Mask, set(Mask, Jobs)) :- mask_jobs(Mask, Jobs).

%!  cover(+Jobs, +Pool, +Seats, +State, -Chosen) is semidet.
%
%   Chosen: I-Mask, the jobs of each robot that does something. Of State, changed in place, the third argument counts
%   nodes, the fourth holds prices to begin with; those found are left there.

cover(Jobs, Pool0, Seats, State, Chosen) :-
    % Where the team is complete, only those that are in it count.
    ( Seats =< 0 -> include(used, Pool0, Pool1) ; Pool1 = Pool0 ),
    State = state(_, _, Nodes, Prices0, _),
    Nodes1 is Nodes + 1,
    nb_setarg(3, State, Nodes1),
    priced(100, Pool1, Jobs, Seats, Prices0, Prices, Result),
    ( ground(Prices) -> nb_setarg(4, State, Prices) ; true ),
    Result \== refuted,
    affordable(Pool1, Jobs, Seats, Prices, Pool),
    node(Jobs, Pool, Seats, Prices, State, Chosen).

used(p(_, true, _, _, _)).

%   Prices go on from those of the node above: few rounds are enough.
node(Jobs0, Pool0, Seats0, Prices0, State, Chosen) :-
    State = state(_, _, Nodes, _, _),
    Nodes1 is Nodes + 1,
    nb_setarg(3, State, Nodes1),
    forced(Jobs0, Pool0, Seats0, Jobs, Pool1, Seats),
    (   Jobs == []
    ->  chosen(Pool1, [], 0, Chosen)
    ;   priced(20, Pool1, Jobs, Seats, Prices0, Prices, Result),
        (   Result = done(Takes), \+ member(p(_, _, _, false, _), Pool1)
        ->  chosen(Pool1, Takes, 0, Chosen)
        ;   Result \== refuted,
            affordable(Pool1, Jobs, Seats, Prices, Pool),
            \+ memberchk(p(_, true, _, _, []), Pool),
            branch(Jobs, Pool, Prices, Job, I),
            (   given(Job, I, Jobs, Pool, Seats, Jobs2, Pool2, Seats2),
                node(Jobs2, Pool2, Seats2, Prices, State, Chosen)
            ->  true
            ;   refused(Job, I, Pool, Pool3),
                node(Jobs, Pool3, Seats, Prices, State, Chosen)
            )
        )
    ).

%   A robot does what it must and, of the jobs that it takes, those that none before it does.
chosen([], _, _, []).
chosen([p(I, _, Must, _, _)|Pool], Takes, Done0, Chosen) :-
    (   memberchk(take(I, Jobs), Takes)
    ->  jobs_mask(Jobs, Mask),
        Mine is Must \/ (Mask /\ \Done0)
    ;   Mine = Must
    ),
    Done is Done0 \/ Mine,
    ( Mine =:= 0 -> Chosen = Chosen1 ; Chosen = [I-Mine|Chosen1] ),
    chosen(Pool, Takes, Done, Chosen1).

%   Gives away all jobs that only one robot can do. Fails if there is one that none can.
forced(Jobs0, Pool0, Seats0, Jobs, Pool, Seats) :-
    maplist(union, Pool0, Unions0),
    once_and_twice(Unions0, 0, Once, 0, Twice),
    jobs_mask(Jobs0, Needed),
    Needed /\ \Once =:= 0,
    Single is Needed /\ \Twice,
    (   Single =:= 0
    ->  Jobs = Jobs0, Pool = Pool0, Seats = Seats0
    ;   Job is lsb(Single),
        Bit is 1 << Job,
        member(I-Union, Unions0),
        Union /\ Bit =\= 0
    ->  given(Job, I, Jobs0, Pool0, Seats0, Jobs1, Pool1, Seats1),
        forced(Jobs1, Pool1, Seats1, Jobs, Pool, Seats)
    ).

once_and_twice([], Once, Once, Twice, Twice).
once_and_twice([_-Union|Unions], Once0, Once, Twice0, Twice) :-
    Twice1 is Twice0 \/ (Once0 /\ Union),
    Once1 is Once0 \/ Union,
    once_and_twice(Unions, Once1, Once, Twice1, Twice).

union(p(I, _, _, _, Sets), I-Union) :-
    masks(Sets, 0, Union).

masks([], Union, Union).
masks([set(Mask, _)|Sets], Union0, Union) :-
    Union1 is Union0 \/ Mask,
    masks(Sets, Union1, Union).

%   The job that fewest robots can do, the dearest of these; the robot that loses least by doing it.
branch(Jobs, Pool, Prices, Job, I) :-
    maplist(union, Pool, Unions),
    findall(Few-Cheap-Job1,
            ( member(Job1, Jobs), Bit is 1 << Job1, arg(Job1, Prices, Price), Cheap is -Price,
              aggregate_all(count, ( member(_-Union, Unions), Union /\ Bit =\= 0 ), Few) ),
            Ranked),
    sort(Ranked, [_-_-Job|_]),
    Bit is 1 << Job,
    findall(Loss-I1, ( member(p(I1, _, _, _, Sets), Pool), loss(Sets, Bit, Prices, Loss) ), Losses),
    sort(Losses, [_-I|_]).

loss(Sets, Bit, Prices, Loss) :-
    findall(Worth, ( member(set(Mask, Jobs), Sets), Mask /\ Bit =\= 0, worth(Jobs, Prices, 0, Worth) ), With),
    With \== [],
    max_list(With, Most),
    findall(Worth, ( member(set(_, Jobs), Sets), worth(Jobs, Prices, 0, Worth) ), All),
    max_list(All, Best),
    Loss is Best - Most.

%!  given(+Job, +I, +Jobs, +Pool, +Seats, -Jobs, -Pool, -Seats) is semidet.
%
%   The Ith robot does the job, the others do not.

given(Job, I, Jobs0, Pool0, Seats0, Jobs, Pool, Seats) :-
    selectchk(Job, Jobs0, Jobs),
    Bit is 1 << Job,
    memberchk(p(I, Used, _, _, _), Pool0),
    ( Used == true -> Seats = Seats0 ; Seats is Seats0 - 1 ),
    give(Pool0, Job, Bit, I, Seats, Pool).

give([], _, _, _, _, []).
give([p(J, Used, Must, Monotone, Sets0)|Pool0], Job, Bit, I, Seats, Pool) :-
    (   J =:= I
    ->  with(Sets0, Job, Bit, Sets1),
        Sets1 \== [],
        sort(Sets1, Sets),
        Must1 is Must \/ Bit,
        Pool = [p(J, true, Must1, Monotone, Sets)|Pool1]
    ;   Used == false, Seats =< 0
    ->  Pool = Pool1
    ;   without(Sets0, Monotone, Job, Bit, Sets1),
        sort(Sets1, Sets),
        ( Sets == [] -> Used == false, Pool = Pool1 ; Pool = [p(J, Used, Must, Monotone, Sets)|Pool1] )
    ),
    give(Pool0, Job, Bit, I, Seats, Pool1).

with([], _, _, []).
with([set(Mask, Jobs)|Sets], Job, Bit, With) :-
    (   Mask /\ Bit =\= 0
    ->  Mask1 is Mask xor Bit,
        selectchk(Job, Jobs, Jobs1),
        With = [set(Mask1, Jobs1)|With1]
    ;   With = With1
    ),
    with(Sets, Job, Bit, With1).

without([], _, _, _, []).
without([Set|Sets], Monotone, Job, Bit, Without) :-
    Set = set(Mask, Jobs),
    (   Mask /\ Bit =:= 0
    ->  Without = [Set|Without1]
    ;   Monotone == true
    ->  Mask1 is Mask xor Bit,
        selectchk(Job, Jobs, Jobs1),
        Without = [set(Mask1, Jobs1)|Without1]
    ;   Without = Without1
    ),
    without(Sets, Monotone, Job, Bit, Without1).

%   The Ith robot does not do the job; nor does one that is like it, which could change places with it.
refused(Job, I, Pool0, Pool) :-
    memberchk(p(I, Used, _, Monotone, Sets), Pool0),
    Bit is 1 << Job,
    maplist(refuse(Job, Bit, I, like(Used, Monotone, Sets)), Pool0, Pool).

refuse(Job, Bit, I, Like, Robot0, Robot) :-
    Robot0 = p(J, Used, Must, Monotone, Sets0),
    (   ( J =:= I ; Used == false, Like == like(Used, Monotone, Sets0) )
    ->  without(Sets0, Monotone, Job, Bit, Sets1),
        sort(Sets1, Sets),
        ( Sets == [] -> Used == false ; true ),
        Robot = p(J, Used, Must, Monotone, Sets)
    ;   Robot = Robot0
    ).
