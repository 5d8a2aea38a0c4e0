:- module(planner_legs,
          [ leg/5,                      % +Job, +Way, +Tables, -Robots, -Leg
            leg_job/2,                  % +Leg, -Job
            leg_spare/2,                % +Leg, -Milliseconds
            leg_cost/3,                 % +Leg, +Row, -Milliseconds
            leg_end/3,                  % +Leg, +At, -At
            leg_and_back/1,             % +Leg
            leg_steps/6,                % +Leg, +Robot, +Row, +From, -Steps, -To
            leg_choices/3,              % +Leg, +Robot, -Choices
            undominated/2,              % +Legs, -Legs
            tables/3,                   % +Travel, +Robot, -Tables
            row/3,                      % +Tables, +At, -Row
            never/1                     % -Milliseconds
          ]).

/** <module> Legs: the ways in which one robot does one job in one go

    leg(Job, Goal, Odds, Ms, Spare, End, Choices, Own, Parts)
      Goal     where it travels to first (in a step of these Odds of success), or none
      Ms       how long everything but that travel takes; Spare of it are computations
      End      where the robot is then, or same: where it was
      Choices  Id-Label of the alternatives that lead here; Own: ids of those at which the robot itself is chosen
      Parts    part(Id, Who, Ms, Travels), Who = robot | none: one after the other, without pauses

Places are indices of the travel table; 0 is where the robot is when the plan is made. A row holds the
travel times from one place: tables(Here, Table) has that of 0, and those of the others.
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(planner_golog(durations), [expected/3]).

%!  never(-Milliseconds) is det.
%
%   Later than any plan ends.

never(1_000_000_000_000_000).

%!  tables(+Travel, +Robot, -Tables) is det.

tables(travel(_, Profiles, Between, Heres), Robot, tables(Here, Table)) :-
    ( get_assoc(Robot, Heres, Here) -> true ; Here = r ),
    ( get_assoc(Robot, Profiles, Profile) -> arg(Profile, Between, Table) ; Table = m ).

row(tables(Here, Table), At, Row) :-
    ( At =:= 0 -> Row = Here ; arg(At, Table, Row) ).

%!  leg(+Job, +Way, +Travel, -Robots, -Leg) is nondet.
%
%   Way is way(Who, Labels, Choices, Own, Steps, Go) of planner_jobs. What travels twice takes each robot its
%   own time; else one leg serves all for whom a placeholder stands. Fails where there is no way.
%
%   @throws coupled if the robot's other work may have to come in between, or where it travels from is open

leg(Job, way(Who, Labels, Choices, Own, Steps, Go), Travel, Robots, Leg) :-
    (   Labels == [] -> Robots = [Who]
    ;   inner_travel(Steps) -> member(Robot, Labels), Robots = [Robot]
    ;   Robots = Labels
    ),
    Robots = [First|_],
    tables(Travel, First, Tables),
    Leg = leg(Job, Goal, Odds, Ms, Spare, End, Choices, Own, Parts),
    foldl(add_step(Go, Tables, Travel), Steps, leg(none, 1, 0, 0, same, []), leg(Goal, Odds, Ms, Spare, End, Reversed)),
    reverse(Reversed, Parts).

inner_travel(Steps) :-
    append(_, [step(_, Who, _, _, _, End)|Later], Steps),
    Who \== none,
    End \== none,
    member(step(_, _, Goal, _, _, _), Later),
    Goal \== none, !.

add_step(Go, Tables, Travel, step(Id, Who, Goal, Odds, Fixed, Ends), Leg0, Leg) :-
    Leg0 = leg(Goal0, Odds0, Ms0, Spare0, At0, Parts),
    (   Who == none
    ->  ( Go == tight -> true ; throw(coupled) ),
        Ms is Ms0 + Fixed, Spare is Spare0 + Fixed,
        Leg = leg(Goal0, Odds0, Ms, Spare, At0, [part(Id, none, Fixed, false)|Parts])
    ;   place(Ends, Travel, At0, At),
        (   Goal == none
        ->  loose_ends(Go, At0, At),
            Ms is Ms0 + Fixed,
            Leg = leg(Goal0, Odds0, Ms, Spare0, At, [part(Id, robot, Fixed, false)|Parts])
        ;   At0 == same
        ->  ( Goal0 == none -> true ; throw(coupled) ),
            place(Goal, Travel, _, To),
            ( Odds =:= 1 -> Odds1 = 1 ; Odds1 = Odds ),
            Ms is Ms0 + Fixed,
            Leg = leg(To, Odds1, Ms, Spare0, At, [part(Id, robot, Fixed, true)|Parts])
        ;   ( Go == tight -> true ; throw(coupled) ),
            row(Tables, At0, Row),
            place(Goal, Travel, _, To),
            arg(To, Row, Way),
            Way >= 0,
            expected(Way, Odds, More),
            Both is More + Fixed,
            Ms is Ms0 + Both,
            Leg = leg(Goal0, Odds0, Ms, Spare0, At, [part(Id, robot, Both, false)|Parts])
        )
    ).

place(none, _, At, At) :- !.
place(Place, travel(Index, _, _, _), _, At) :-
    get_assoc(Place, Index, At).

%   What need not follow at once must not move the robot.
loose_ends(tight, _, _) :- !.
loose_ends(loose, At, At) :- !.
loose_ends(_, _, _) :- throw(coupled).

%!  leg_cost(+Leg, +Row, -Milliseconds) is semidet.
%
%   How long it takes from the place that the row is of; fails where there is no way.

leg_cost(leg(_, Goal, Odds, Ms, _, _, _, _, _), Row, Cost) :-
    (   Goal == none
    ->  Cost = Ms
    ;   arg(Goal, Row, Way),
        Way >= 0,
        (   Odds == 1
        ->  Cost is Ms + Way
        ;   expected(Way, Odds, Expected),
            Cost is Ms + Expected
        )
    ).

leg_end(leg(_, _, _, _, _, End, _, _, _), At0, At) :-
    ( End == same -> At = At0 ; At = End ).

%!  leg_and_back(+Leg) is semidet.
%
%   It travels, yet the robot is then where it was.

leg_and_back(leg(_, Goal, _, _, _, End, _, _, _)) :-
    Goal \== none,
    End == same.

leg_job(leg(Job, _, _, _, _, _, _, _, _), Job).

leg_spare(leg(_, _, _, _, Spare, _, _, _, _), Spare).

%!  leg_steps(+Leg, +Robot, +Row, +From, -Steps, -To) is det.
%
%   Steps are step(From, To, Id, Robots).

leg_steps(Leg, Robot, Row, From, Steps, To) :-
    Leg = leg(_, _, _, Ms, _, _, _, _, Parts),
    leg_cost(Leg, Row, Cost),
    Travel is Cost - Ms,
    timed(Parts, Robot, Travel, From, Steps, To).

timed([], _, _, End, [], End).
timed([part(Id, Who, Ms, Travels)|Parts], Robot, Travel, From, [step(From, To, Id, Robots)|Steps], End) :-
    ( Who == robot -> Robots = [Robot] ; Robots = [] ),
    ( Travels == true -> To is From + Travel + Ms ; To is From + Ms ),
    timed(Parts, Robot, Travel, To, Steps, End).

leg_choices(leg(_, _, _, _, _, _, Choices, Own, _), Robot, All) :-
    findall(Id-Robot, member(Id, Own), Robots),
    append(Choices, Robots, All).

%!  undominated(+Legs, -Legs) is det.
%
%   Of one robot; those of the same job next to each other. A leg goes where another one does the same job
%   between the same places in no more time and work.

undominated([], []).
undominated([Leg|Legs], Best) :-
    leg_job(Leg, Job),
    same_job(Legs, Job, Same, Rest),
    (   Same == [] -> Best = [Leg|Best1] ; of_one_job([Leg|Same], [], Best, Best1) ),
    undominated(Rest, Best1).

same_job([Leg|Legs], Job, [Leg|Same], Rest) :-
    leg_job(Leg, Job), !,
    same_job(Legs, Job, Same, Rest).
same_job(Legs, _, [], Legs).

of_one_job([], Kept, Best, Rest) :-
    reverse(Kept, Kept1),
    append(Kept1, Rest, Best).
of_one_job([Leg|Legs], Kept, Best, Rest) :-
    (   ( member(Other, Kept) ; member(Other, Legs), \+ no_worse(Leg, Other) ), no_worse(Other, Leg)
    ->  of_one_job(Legs, Kept, Best, Rest)
    ;   of_one_job(Legs, [Leg|Kept], Best, Rest)
    ).

no_worse(leg(_, Goal, Odds, Ms1, Spare1, End, _, _, _), leg(_, Goal, Odds, Ms2, Spare2, End, _, _, _)) :-
    Ms1 =< Ms2,
    Ms1 - Spare1 =< Ms2 - Spare2.
